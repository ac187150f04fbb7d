// Uncertainty of a transform. In: a hypothesis. Out: the covariance of its transform, from the residuals of
// its pairs and from where they lie.
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/small_solver.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/robust_fit.hpp"
#include "globalmatch/matching.hpp"

namespace globalmatch::detail {

/// Variance of Student's t.
inline double variance_of_t(double degrees) {
  return degrees / (degrees - 2);
}

/// `transform_uncertainty` in the levelled local frame.
struct local_uncertainty {
  vec3 center;              ///< [m] centroid of the paired stems
  small_matrix covariance;  ///< of x, y, z [m] and the turns [rad]; 4 x 4 or 6 x 6
};

/// Shift and turn from residuals: the inverse of the normal matrix, times the variance that the residuals
/// have. Unknowns are x, y and the turn in 4-DoF, and x, y, z and three turns in 6-DoF.
class residual_adjustment {
 public:
  explicit residual_adjustment(bool four) : dimensions_(four ? 2 : 3) { normal_.size = four ? 3 : 6; }

  /// `arm` [m] leads from the center to the stem; `variance` [m^2] is that of a coordinate of the residual,
  /// but for one factor.
  void add(const vec3& arm, const vec3& residual, double variance) {
    small_vector rows[3] = {};
    for (std::size_t axis = 0; axis < dimensions_; ++axis) rows[axis][axis] = 1;
    for (std::size_t turn = 0; dimensions_ + turn < normal_.size; ++turn) {
      vec3 about;
      about[dimensions_ == 2 ? 2 : turn] = 1;
      const vec3 moved = about.cross(arm);
      for (std::size_t axis = 0; axis < dimensions_; ++axis) rows[axis][dimensions_ + turn] = moved[axis];
    }
    double squares = residual.x * residual.x + residual.y * residual.y;
    if (dimensions_ == 3) squares += residual.z * residual.z;
    for (std::size_t c = 0; c < normal_.size; ++c)
      for (std::size_t r = 0; r < normal_.size; ++r) {
        double product = rows[0][r] * rows[0][c] + rows[1][r] * rows[1][c];
        if (dimensions_ == 3) product += rows[2][r] * rows[2][c];
        normal_(r, c) += product / variance;
      }
    squares_ += squares / variance;
    coordinates_ += double(dimensions_);
  }

  small_matrix covariance() const {
    constexpr double efficiency = 0.95;  // of the robust weights, see `robust_weights`
    const double degrees = coordinates_ - double(normal_.size);
    const double factor = variance_of_t(degrees) * squares_ / (efficiency * degrees);
    small_matrix result = small_solver(normal_).inverse();
    for (double& number : result.numbers) number = factor * number;
    return result;
  }

 private:
  std::size_t dimensions_;
  small_matrix normal_;
  double squares_ = 0, coordinates_ = 0;
};

/// Variance [m^2] of the height in 4-DoF, a median.
inline double variance_of_height(const local_hypothesis& h, const matching_context& context) {
  const double median_of_normal = std::numbers::pi / 2;  // its variance, against that of the mean
  const double count = double(h.correspondences.size());
  double squares = 0;
  for (const correspondence& c : h.correspondences)
    squares +=
        std::pow((h.target_from_source * context.source.at[c.source] - context.target.at[c.target]).z, 2);
  return median_of_normal * variance_of_t(count - 1) * squares / (count - 1) / count;
}

/// Uncertainty of a hypothesis' transform, least squares over its pairs, in the frames of `context`;
/// residuals are taken for independent, and as large as `position_sigma` says, but for one factor, or alike.
/// The height of 4-DoF has that of a median; 0 where a map has no heights. Nothing for fewer than four pairs.
/// Cost: linear in the pairs.
inline std::optional<local_uncertainty> uncertainty_of(const local_hypothesis& h,
                                                       const matching_context& context) {
  constexpr std::size_t minimum = 4;
  if (h.correspondences.size() < minimum) return std::nullopt;
  const bool four = context.dof == degrees_of_freedom::four;
  local_uncertainty result;
  for (const correspondence& c : h.correspondences)
    result.center += h.target_from_source * context.source.at[c.source] / double(h.correspondences.size());
  const double unknown = unknown_variance(context, h);
  residual_adjustment adjustment(four);
  std::size_t adjusted = 0;
  for (const correspondence& c : h.correspondences) {
    context.poll_cancelled_at(adjusted++);
    const vec3 transformed = h.target_from_source * context.source.at[c.source];
    adjustment.add(transformed - result.center, context.target.at[c.target] - transformed,
                   known_variance(context, c) + unknown);
  }
  const small_matrix adjusted_covariance = adjustment.covariance();
  if (!four) {
    result.covariance = adjusted_covariance;
    return result;
  }
  result.covariance.size = 4;  // the height has nothing to do with the rest
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t r = 0; r < 3; ++r)
      result.covariance(r < 2 ? r : 3, c < 2 ? c : 3) = adjusted_covariance(r, c);
  if (context.source.has_heights && context.target.has_heights)
    result.covariance(2, 2) = variance_of_height(h, context);
  return result;
}

/// Product of two square matrices, the second one transposed if asked for.
inline small_matrix product(const small_matrix& a, const small_matrix& b, bool transposed = false) {
  small_matrix result;
  result.size = a.size;
  for (std::size_t c = 0; c < a.size; ++c)
    for (std::size_t r = 0; r < a.size; ++r)
      for (std::size_t k = 0; k < a.size; ++k) result(r, c) += a(r, k) * (transposed ? b(c, k) : b(k, c));
  return result;
}

/// From a levelled local frame to that of its caller.
inline transform_uncertainty in_caller_frame(const local_uncertainty& u, const local_frame& frame) {
  const mat3 scan_from_local = frame.rotation.transpose();
  small_matrix turned;
  turned.size = u.covariance.size;
  turned(3, 3) = 1;
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) {
      const auto row = std::size_t(r), column = std::size_t(c);
      turned(row, column) = scan_from_local(r, c);
      if (turned.size == 6) turned(3 + row, 3 + column) = scan_from_local(r, c);
    }
  const small_matrix covariance = product(product(turned, u.covariance), turned, true);
  transform_uncertainty result{to_eigen(frame.to_scan(u.center)),
                               to_eigen(scan_from_local * vec3{0, 0, 1}),
                               {Eigen::Index(covariance.size), Eigen::Index(covariance.size)}};
  for (std::size_t c = 0; c < covariance.size; ++c)
    for (std::size_t r = 0; r < covariance.size; ++r)
      result.covariance.data()[covariance.size * c + r] = covariance(r, c);
  return result;
}

}  // namespace globalmatch::detail

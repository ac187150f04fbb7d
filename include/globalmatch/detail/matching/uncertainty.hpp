// Uncertainty of a transform. In: a hypothesis. Out: the covariance of its transform, from the residuals of
// its pairs and from where they lie.
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/small_solver.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/robust_fit.hpp"
#include "globalmatch/detail/matching/vertical_fit.hpp"
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

/// Adds to the variances of x and y what errors have in common and does not average out: stems are seen from
/// the side of their scanner.
inline void add_shared_variance(small_matrix& covariance) {
  constexpr double shared_sigma = 5e-4;  // [m]
  covariance(0, 0) += shared_sigma * shared_sigma;
  covariance(1, 1) += shared_sigma * shared_sigma;
}

/// Uncertainty of a hypothesis' transform, least squares over its pairs, in the frames of `context`;
/// residuals are taken for independent, and as large as `position_sigma` says, but for one factor, or alike.
/// `vertical` gives that of the height in 4-DoF, and all of it where a scan is rotated. Nothing for fewer
/// than four pairs. Cost: linear in the pairs.
inline std::optional<local_uncertainty> uncertainty_of(const local_hypothesis& h,
                                                       const matching_context& context,
                                                       const local_vertical_fit& vertical = {}) {
  constexpr std::size_t minimum = 4;
  if (h.correspondences.size() < minimum) return std::nullopt;
  const bool four = context.dof == degrees_of_freedom::four;
  local_uncertainty result;
  if (vertical.covariance) {
    result = {vertical.center, *vertical.covariance};
    add_shared_variance(result.covariance);
    return result;
  }
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
    add_shared_variance(result.covariance);
    return result;
  }
  result.covariance.size = 4;  // the height has nothing to do with the rest
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t r = 0; r < 3; ++r)
      result.covariance(r < 2 ? r : 3, c < 2 ? c : 3) = adjusted_covariance(r, c);
  result.covariance(2, 2) = height_variance(vertical.fit);
  add_shared_variance(result.covariance);
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

/// Standard deviation [m] along `up`, at the center.
inline double height_sigma(const transform_uncertainty& u) {
  const Eigen::Matrix3d at_center = u.at(u.center);
  double variance = 0;
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) variance += u.up[r] * at_center(r, c) * u.up[c];
  return std::sqrt(variance);
}

/// Replaces the variance [m^2] of the height, which then has nothing to do with the rest.
inline void set_height_variance(transform_uncertainty& u, double variance) {
  const double up[3] = {u.up[0], u.up[1], u.up[2]};
  const Eigen::Index size = u.covariance.rows();
  small_matrix known, across;  // less what is along `up`
  known.size = across.size = std::size_t(size);
  for (std::size_t c = 0; c < known.size; ++c)
    for (std::size_t r = 0; r < known.size; ++r) {
      known(r, c) = u.covariance.data()[known.size * c + r];
      across(r, c) = (r == c ? 1 : 0) - (r < 3 && c < 3 ? up[r] * up[c] : 0);
    }
  const small_matrix rest = product(product(across, known), across, true);
  for (std::size_t c = 0; c < known.size; ++c)
    for (std::size_t r = 0; r < known.size; ++r)
      u.covariance.data()[known.size * c + r] = rest(r, c) + (r < 3 && c < 3 ? variance * up[r] * up[c] : 0);
}

/// Whether two transforms differ in plan by no more than the uncertainty of the first one allows (99.7 % of
/// errors are smaller). True where it has none.
inline bool moves_within(const std::optional<transform_uncertainty>& u, const Eigen::Isometry3d& from,
                         const Eigen::Isometry3d& to) {
  constexpr double quantile = 13.93;  // of chi squared, three degrees of freedom
  if (!u) return true;
  const rigid moved = from_eigen(to) * from_eigen(from).inverse();
  const vec3 up = from_eigen(u->up), center = from_eigen(u->center), shift = moved * center - center;
  const vec3 first = up.unit_orthogonal(), second = up.cross(first);
  const mat3& r = moved.rotation;
  const vec3 turn = 0.5 * vec3{r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)};
  const small_vector change = {shift.dot(first), shift.dot(second), turn.dot(up)};
  const auto size = std::size_t(u->covariance.rows());
  small_vector rows[3] = {{first.x, first.y, first.z}, {second.x, second.y, second.z}, {0, 0, 0, 1}};
  if (size == 6) rows[2] = {0, 0, 0, up.x, up.y, up.z};
  small_matrix horizontal;
  horizontal.size = 3;
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b)
      for (std::size_t i = 0; i < size; ++i)
        for (std::size_t k = 0; k < size; ++k)
          horizontal(a, b) += rows[a][i] * rows[b][k] * u->covariance.data()[size * k + i];
  const small_vector solved = small_solver(horizontal).solve(change);
  return change[0] * solved[0] + change[1] * solved[1] + change[2] * solved[2] <= quantile;
}

}  // namespace globalmatch::detail

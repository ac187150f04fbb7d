// Least squares fit of a cylinder ([GM] 3.1), and its uncertainty. In: points in a levelled local frame and a
// cylinder near them. Out: the cylinder refined. Cost: iterations times points.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>

#include "globalmatch/detail/core/float_lanes.hpp"
#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/core/small_solver.hpp"
#include "globalmatch/detail/mapping/cylinder.hpp"
#include "globalmatch/mapping_options.hpp"

namespace globalmatch::detail {

/// Sums over points near a cylinder, in floats, eight at a time.
struct cylinder_sums {
  float_lanes weighted[5][3] = {};   // of 1, a, b, a^2, a b; times 1, t, t^2
  float_lanes residuals[3][2] = {};  // of the residual times 1, a, b; times 1, t

  /// Points (du, dv) off the axis and `t` up along it; those on the axis are not counted.
  void add(const float_lanes& du, const float_lanes& dv, const float_lanes& t, float radius, float taper,
           float tolerance) {
    float_lanes distance, residual, terms[5];
    for (std::size_t k = 0; k < lane_count; ++k) distance[k] = du[k] * du[k] + dv[k] * dv[k];
    take_square_roots(distance.data(), lane_count);
    for (std::size_t k = 0; k < lane_count; ++k) {
      residual[k] = distance[k] - radius + taper * t[k];
      terms[0][k] = one_if_positive(tolerance - std::abs(residual[k])) * one_if_positive(distance[k]);
      const float inverse = terms[0][k] / std::max(distance[k], std::numeric_limits<float>::min());
      terms[1][k] = -du[k] * inverse;
      terms[2][k] = -dv[k] * inverse;
      terms[3][k] = terms[1][k] * terms[1][k];
      terms[4][k] = terms[1][k] * terms[2][k];
    }
    for (std::size_t i = 0; i < 5; ++i)
      for (std::size_t k = 0; k < lane_count; ++k) {
        weighted[i][0][k] += terms[i][k];
        weighted[i][1][k] += terms[i][k] * t[k];
        weighted[i][2][k] += terms[i][k] * (t[k] * t[k]);
      }
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < lane_count; ++k) {
        residuals[i][0][k] += terms[i][k] * residual[k];
        residuals[i][1][k] += terms[i][k] * residual[k] * t[k];
      }
  }
};

/// Normal equations of the surface distances, linear in (shift along u, shift along v, tilt towards u, tilt
/// towards v, radius, taper), over the points within `tolerance` of the surface. The row of a point that lies
/// in direction -(a, b) from the axis, `t` up along it, is (a, b, t a, t b, -1, t): all products of two are
/// those of 1, a, b, a^2 and a b with powers of t.
struct cylinder_equations {
  vec3 u, v;  // complete the axis to a right-handed frame
  small_matrix normal;
  small_vector right{};
  std::size_t count = 0;

  cylinder_equations(const cylinder& c, std::span<const vec3> points, double tolerance)
      : u(c.axis.unit_orthogonal()), v(c.axis.cross(u)) {
    const mat3 across = mat3::rows_of(u, v, c.axis);
    cylinder_sums sums;
    for (std::size_t begin = 0; begin < points.size(); begin += lane_count) {
      float_lanes du{}, dv{}, t{};
      const std::size_t some = std::min(lane_count, points.size() - begin);
      for (std::size_t k = 0; k < some; ++k) {
        const vec3 d = across * (points[begin + k] - c.point);
        du[k] = float(d.x), dv[k] = float(d.y), t[k] = float(d.z);
      }
      sums.add(du, dv, t, float(c.radius), float(c.taper), float(tolerance));
    }
    fill(sums);
    constexpr double damping = 1e-6;  // a share of the points: keeps what they do not determine where it is
    for (std::size_t i = 0; i < 6; ++i) normal(i, i) += damping * double(count);
  }

  /// Holds the taper near the usual one; without one it is none.
  void expect_taper(double taper, const cylinder_options& options) {
    const double weight = options.usual_taper ? options.taper_weight : 1e9;
    normal(5, 5) += weight;
    right[5] += weight * (options.usual_taper.value_or(0) - taper);
  }

 private:
  void fill(const cylinder_sums& sums) {
    double n[5][3], r[3][2];
    for (std::size_t p = 0; p < 3; ++p)
      for (std::size_t i = 0; i < 5; ++i) n[i][p] = sum_of(sums.weighted[i][p]);
    for (std::size_t p = 0; p < 2; ++p)
      for (std::size_t i = 0; i < 3; ++i) r[i][p] = sum_of(sums.residuals[i][p]);
    // Rows and columns come in pairs, along u and along v, with powers of t: 0 for the shift, 1 for the tilt.
    for (std::size_t p = 0; p < 2; ++p)
      for (std::size_t q = 0; q < 2; ++q) {
        normal(2 * p, 2 * q) = n[3][p + q];
        normal(2 * p, 2 * q + 1) = normal(2 * p + 1, 2 * q) = n[4][p + q];
        normal(2 * p + 1, 2 * q + 1) = n[0][p + q] - n[3][p + q];
      }
    for (std::size_t p = 0; p < 2; ++p)
      for (std::size_t i = 0; i < 2; ++i) {
        normal(2 * p + i, 4) = normal(4, 2 * p + i) = -n[1 + i][p];
        normal(2 * p + i, 5) = normal(5, 2 * p + i) = n[1 + i][p + 1];
        right[2 * p + i] = -r[1 + i][p];
      }
    normal(4, 4) = n[0][0];
    normal(4, 5) = normal(5, 4) = -n[0][1];
    normal(5, 5) = n[0][2];
    right[4] = r[0][0];
    right[5] = -r[0][1];
    count = static_cast<std::size_t>(n[0][0]);
  }
};

/// Least squares over the parameters of the cylinder (Gauss-Newton), over the points within `tolerance` [m]
/// of the surface, chosen again in each iteration; it begins with points as far as `max_distance` [m].
/// `point` comes to lie beside their middle. Nothing when there are fewer than six, or when it leaves the
/// limits.
inline std::optional<cylinder> refine_cylinder(cylinder c, std::span<const vec3> points, double tolerance,
                                               const cylinder_options& options, double max_distance = 0) {
  constexpr int max_iterations = 10;
  constexpr double convergence_threshold = 1e-5;
  vec3 middle;
  for (const vec3& p : points) middle += p / double(points.size());
  c.point += c.axis * c.axis.dot(middle - c.point);  // the axis turns about this point
  double band = std::max(max_distance, tolerance);
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    cylinder_equations equations(c, points, band);
    if (equations.count < 6) return std::nullopt;
    equations.expect_taper(c.taper, options);
    const small_vector step = small_solver(equations.normal).solve(equations.right);
    c.point += step[0] * equations.u + step[1] * equations.v;
    c.axis = (c.axis + step[2] * equations.u + step[3] * equations.v).normalized();
    c.radius += step[4];
    c.taper += step[5];
    double squares = 0;
    for (const double s : step) squares += s * s;
    if (!std::isfinite(squares) || !within_limits(c, options)) return std::nullopt;
    if (band == tolerance && std::sqrt(squares) < convergence_threshold) break;
    band = std::max(tolerance, band / 1.6);
  }
  return c;
}

/// Covariance of a cylinder: of the shift along u and v at `point` [m], the tilt towards u and v, the radius
/// [m] and the taper [m/m], when points scatter by `sigma` [m] about the surface. Large when they show little
/// of its curve.
inline small_matrix cylinder_covariance(const cylinder& c, std::span<const vec3> points, double sigma,
                                        const cylinder_options& options = {}) {
  cylinder_equations equations(c, points, std::numeric_limits<double>::infinity());
  equations.expect_taper(c.taper, options);
  small_matrix covariance = small_solver(equations.normal).inverse();
  for (double& number : covariance.numbers) number *= sigma * sigma;
  return covariance;
}

/// Standard deviation [m] of the axis, across its worst direction, `along` [m] up from `point`.
inline double axis_uncertainty(const small_matrix& c, double along = 0) {
  const auto at = [&](std::size_t i, std::size_t j) {
    return (c(i, j) + along * c(i + 2, j)) + (c(i, j + 2) + along * c(i + 2, j + 2)) * along;
  };
  const double uu = at(0, 0), vv = at(1, 1), uv = at(0, 1), half = (uu - vv) / 2;
  return std::sqrt(std::max(0.0, (uu + vv) / 2 + std::sqrt(half * half + uv * uv)));
}

/// Standard deviation [m] of the radius, `along` [m] up from `point`.
inline double radius_uncertainty(const small_matrix& c, double along = 0) {
  return std::sqrt(std::max(0.0, c(4, 4) - 2 * along * c(4, 5) + along * along * c(5, 5)));
}

}  // namespace globalmatch::detail

// Cylinder ([GM] 3.1): RANSAC (Fischler and Bolles 1981) over a few oriented points, then least squares.
// In: points with normals in a levelled local frame. Out: the cylinder most of them lie on.
// [GM] gives no values for RANSAC: the options are ours. Cost: draws times points.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/mapping_options.hpp"

namespace globalmatch::detail {

/// Tolerance when neither the caller nor the scan says one.
constexpr double default_distance_tolerance = 0.02;  // [m]

/// An endless cylinder, slightly tapered as stems are.
struct cylinder {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< [m] a point on the axis
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit, pointing up
  double radius = 0;                                ///< [m] at `point`
  double taper = 0;                                 ///< [m/m] by which it grows thinner upwards

  /// Distance [m] of p from the axis.
  double axis_distance(const Eigen::Vector3d& p) const { return axis.cross(p - point).norm(); }
  /// Signed distance [m] of p from the surface, negative inside.
  double surface_distance(const Eigen::Vector3d& p) const {
    return axis_distance(p) - radius + taper * axis.dot(p - point);
  }
  /// Radius [m] where the axis passes height z; requires an axis that is not horizontal.
  double radius_at_height(double z) const { return radius - taper * (z - point.z()) / axis.z(); }
  /// Where the axis passes height z; requires an axis that is not horizontal.
  Eigen::Vector3d at_height(double z) const { return point + axis * ((z - point.z()) / axis.z()); }
};

inline bool within_limits(const cylinder& c, const cylinder_options& options) {
  return c.radius >= options.min_radius && c.radius <= options.max_radius &&
         c.axis.z() >= std::cos(options.max_tilt_deg * std::numbers::pi / 180);
}

/// Circle through three points in a plane: (centre x, centre y, radius). Nothing when they are collinear.
inline std::optional<Eigen::Vector3d> circle_through(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                                     const Eigen::Vector2d& c) {
  const Eigen::Vector2d u = b - a, v = c - a;
  const double cross = u.x() * v.y() - u.y() * v.x();
  if (std::abs(cross) < 1e-9) return std::nullopt;
  const Eigen::Vector2d center = Eigen::Vector2d(v.y() * u.squaredNorm() - u.y() * v.squaredNorm(),
                                                 u.x() * v.squaredNorm() - v.x() * u.squaredNorm()) /
                                 (2 * cross);
  return Eigen::Vector3d(a.x() + center.x(), a.y() + center.y(), center.norm());
}

/// Two unit vectors that complete `axis` to a right-handed frame.
inline std::pair<Eigen::Vector3d, Eigen::Vector3d> plane_across(const Eigen::Vector3d& axis) {
  const Eigen::Vector3d u = axis.unitOrthogonal();
  return {u, axis.cross(u)};
}

/// The direction that most normals are perpendicular to: that of the axis, if the points are of one stem.
inline Eigen::Vector3d common_direction(std::span<const Eigen::Vector3d> normals) {
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& n : normals) moments += n * n.transpose();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(moments);
  return solver.eigenvectors().col(0);
}

/// Sum of squared surface distances, cut off at the tolerance (MSAC); points inside count double, since a
/// laser does not see into a stem. Stops once it exceeds `enough`.
inline double surface_cost(const cylinder& c, std::span<const Eigen::Vector3d> points, double tolerance,
                           double enough) {
  const double cut = tolerance * tolerance;
  double cost = 0;
  for (const Eigen::Vector3d& p : points) {
    const double d = c.surface_distance(p);
    cost += d < -tolerance ? 2 * cut : std::min(d * d, cut);
    if (cost >= enough) break;
  }
  return cost;
}

/// Normal equations of the surface distances, linear in (shift along u, shift along v, tilt towards u, tilt
/// towards v, radius, taper), over the points within `tolerance` of the surface. The row of a point that lies
/// in direction -(a, b) from the axis, `t` up along it, is (a, b, t a, t b, -1, t): all products of two are
/// those of 1, a, b, a^2 and a b with powers of t. Summed in floats, of points near the axis, in lanes.
struct cylinder_equations {
  using vector = Eigen::Matrix<double, 6, 1>;
  Eigen::Vector3d u, v;
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  vector right = vector::Zero();
  std::size_t count = 0;

  cylinder_equations(const cylinder& c, std::span<const Eigen::Vector3d> points, double tolerance) {
    std::tie(u, v) = plane_across(c.axis);
    Eigen::Matrix3d across;
    across << u.transpose(), v.transpose(), c.axis.transpose();
    sums all;
    for (std::size_t begin = 0; begin < points.size(); begin += width) {
      lanes du = lanes::Zero(), dv = lanes::Zero(), t = lanes::Zero();  // those on the axis are not counted
      const auto some = static_cast<Eigen::Index>(std::min(width, points.size() - begin));
      for (Eigen::Index k = 0; k < some; ++k) {
        const Eigen::Vector3f d = (across * (points[begin + std::size_t(k)] - c.point)).cast<float>();
        du[k] = d.x(), dv[k] = d.y(), t[k] = d.z();
      }
      all.add(du, dv, t, float(c.radius), float(c.taper), float(tolerance));
    }
    const auto [n, n_a, n_b, n_aa, n_ab] = all.totals(all.weighted);
    const auto [r, r_a, r_b] = all.totals(all.residuals);
    Eigen::Matrix<double, 6, 6>& m = normal;
    m.row(0) << n_aa[0], n_ab[0], n_aa[1], n_ab[1], -n_a[0], n_a[1];
    m.row(1) << n_ab[0], n[0] - n_aa[0], n_ab[1], n[1] - n_aa[1], -n_b[0], n_b[1];
    m.row(2) << n_aa[1], n_ab[1], n_aa[2], n_ab[2], -n_a[1], n_a[2];
    m.row(3) << n_ab[1], n[1] - n_aa[1], n_ab[2], n[2] - n_aa[2], -n_b[1], n_b[2];
    m.row(4) << -n_a[0], -n_b[0], -n_a[1], -n_b[1], n[0], -n[1];
    m.row(5) << n_a[1], n_b[1], n_a[2], n_b[2], -n[1], n[2];
    right << -r_a[0], -r_b[0], -r_a[1], -r_b[1], r[0], -r[1];
    count = static_cast<std::size_t>(n[0]);
    constexpr double damping = 1e-6;  // a share of the points: keeps what they do not determine where it is
    normal.diagonal().array() += damping * double(count);
  }

  /// Holds the taper near the usual one; without one it is none.
  void expect_taper(double taper, const cylinder_options& options) {
    const double weight = options.usual_taper ? options.taper_weight : 1e9;
    normal(5, 5) += weight;
    right(5) += weight * (options.usual_taper.value_or(0) - taper);
  }

 private:
  static constexpr std::size_t width = 8;
  using lanes = Eigen::Array<float, int(width), 1>;

  /// 1 where positive, else 0.
  static lanes is_positive(const lanes& x) { return (x * 1e30f).max(0.0f).min(1.0f); }

  struct sums {
    lanes weighted[5][3];   // of 1, a, b, a^2, a b; times 1, t, t^2
    lanes residuals[3][2];  // of the residual times 1, a, b; times 1, t

    sums() {
      for (auto& term : weighted)
        for (lanes& power : term) power.setZero();
      for (auto& term : residuals)
        for (lanes& power : term) power.setZero();
    }
    void add(const lanes& du, const lanes& dv, const lanes& t, float radius, float taper, float tolerance) {
      const lanes distance = (du * du + dv * dv).sqrt();
      const lanes residual = distance - radius + taper * t;
      const lanes counts = is_positive(tolerance - residual.abs()) * is_positive(distance);
      const lanes inverse = counts / distance.max(std::numeric_limits<float>::min());
      const lanes a = -du * inverse, b = -dv * inverse, squared = t * t;
      const lanes terms[5] = {counts, a, b, a * a, a * b};
      for (int i = 0; i < 5; ++i) {
        weighted[i][0] += terms[i];
        weighted[i][1] += terms[i] * t;
        weighted[i][2] += terms[i] * squared;
      }
      for (int i = 0; i < 3; ++i) {
        residuals[i][0] += terms[i] * residual;
        residuals[i][1] += terms[i] * residual * t;
      }
    }
    template <std::size_t Terms, std::size_t Powers>
    static std::array<std::array<double, Powers>, Terms> totals(const lanes (&of)[Terms][Powers]) {
      std::array<std::array<double, Powers>, Terms> result{};
      for (std::size_t i = 0; i < Terms; ++i)
        for (std::size_t p = 0; p < Powers; ++p) result[i][p] = of[i][p].template cast<double>().sum();
      return result;
    }
  };
};

/// Least squares over the parameters of the cylinder (Gauss-Newton), over the points within `tolerance` [m]
/// of the surface, chosen anew each round; it begins with points as far as `max_distance` [m]. `point` comes
/// to lie beside their middle. Nothing when there are fewer than six, or when it leaves the limits.
inline std::optional<cylinder> refine_cylinder(cylinder c, std::span<const Eigen::Vector3d> points,
                                               double tolerance, const cylinder_options& options,
                                               double max_distance = 0) {
  constexpr int max_iterations = 10;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) middle += p / double(points.size());
  c.point += c.axis * c.axis.dot(middle - c.point);  // the axis turns about this point
  double band = std::max(max_distance, tolerance);
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    cylinder_equations equations(c, points, band);
    if (equations.count < 6) return std::nullopt;
    equations.expect_taper(c.taper, options);
    const cylinder_equations::vector step = equations.normal.ldlt().solve(equations.right);
    c.point += step(0) * equations.u + step(1) * equations.v;
    c.axis = (c.axis + step(2) * equations.u + step(3) * equations.v).normalized();
    c.radius += step(4);
    c.taper += step(5);
    if (!step.allFinite() || !within_limits(c, options)) return std::nullopt;
    if (band == tolerance && step.norm() < 1e-5) break;
    band = std::max(tolerance, band / 1.6);
  }
  return c;
}

/// Covariance of a cylinder: of the shift along u and v at `point` [m], the tilt towards u and v, the radius
/// [m] and the taper [m/m].
using cylinder_covariance_matrix = Eigen::Matrix<double, 6, 6>;

/// Covariance of the cylinder when points scatter by `sigma` [m] about the surface. Large when they show
/// little of its curve.
inline cylinder_covariance_matrix cylinder_covariance(const cylinder& c,
                                                      std::span<const Eigen::Vector3d> points, double sigma,
                                                      const cylinder_options& options = {}) {
  cylinder_equations equations(c, points, std::numeric_limits<double>::infinity());
  equations.expect_taper(c.taper, options);
  return sigma * sigma * equations.normal.ldlt().solve(cylinder_covariance_matrix::Identity());
}

/// Standard deviation [m] of the axis, across its worst direction, `along` [m] up from `point`.
inline double axis_uncertainty(const cylinder_covariance_matrix& covariance, double along = 0) {
  Eigen::Matrix<double, 2, 4> at;
  at << 1, 0, along, 0, 0, 1, 0, along;
  const Eigen::Matrix2d c = at * covariance.topLeftCorner<4, 4>() * at.transpose();
  const double half = (c(0, 0) - c(1, 1)) / 2;
  return std::sqrt(std::max(0.0, (c(0, 0) + c(1, 1)) / 2 + std::sqrt(half * half + c(0, 1) * c(0, 1))));
}

/// Standard deviation [m] of the radius, `along` [m] up from `point`.
inline double radius_uncertainty(const cylinder_covariance_matrix& c, double along = 0) {
  return std::sqrt(std::max(0.0, c(4, 4) - 2 * along * c(4, 5) + along * along * c(5, 5)));
}

/// The cylinder that most of the points lie on, by RANSAC and then least squares. `normals` are unit, of any
/// sign. The draws come from `random`. Nothing when no draw gives a cylinder within the limits.
inline std::optional<cylinder> fit_cylinder(std::span<const Eigen::Vector3d> points,
                                            std::span<const Eigen::Vector3d> normals,
                                            const cylinder_options& options, random_source& random) {
  require_valid(options);
  if (points.size() != normals.size())
    throw std::invalid_argument("normals must hold one vector for each point");
  if (points.size() < 6) return std::nullopt;
  const double tolerance = options.distance_tolerance.value_or(default_distance_tolerance);
  const auto count = static_cast<std::uint32_t>(points.size());
  const Eigen::Vector3d common = common_direction(normals);

  std::optional<cylinder> best;
  double best_cost = std::numeric_limits<double>::infinity();
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    const std::uint32_t i = random.below(count), j = random.below(count), k = random.below(count);
    if (i == j || j == k || i == k) continue;
    // Normals of sparse points are rough: their common direction, or up, then serves better than those of two
    // points.
    cylinder c;
    c.axis = iteration % 3 == 0   ? normals[i].cross(normals[j])
             : iteration % 3 == 1 ? common
                                  : Eigen::Vector3d::UnitZ();
    if (c.axis.norm() < 0.3) continue;
    c.axis.normalize();
    if (c.axis.z() < 0) c.axis = -c.axis;
    const auto [u, v] = plane_across(c.axis);
    const auto in_plane = [&, u = u, v = v](const Eigen::Vector3d& p) {
      return Eigen::Vector2d(u.dot(p), v.dot(p));
    };
    const auto circle = circle_through(in_plane(points[i]), in_plane(points[j]), in_plane(points[k]));
    if (!circle) continue;
    c.point = u * circle->x() + v * circle->y() + c.axis * c.axis.dot(points[i]);
    c.radius = circle->z();
    if (!within_limits(c, options)) continue;
    const double cost = surface_cost(c, points, tolerance, best_cost);
    if (cost < best_cost) {
      best_cost = cost;
      best = c;
    }
  }
  if (!best) return std::nullopt;
  return refine_cylinder(*best, points, tolerance, options);
}

}  // namespace globalmatch::detail

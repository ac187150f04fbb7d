// Made-up stem maps, and transforms between them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/positions.hpp"
#include "globalmatch/transform.hpp"

namespace globalmatch::scenes {

using namespace detail;

using positions = std::vector<Eigen::Vector3d>;

constexpr auto four = degrees_of_freedom::four, six = degrees_of_freedom::six;

inline double uniform(random_source& random, double from, double to) {
  return from + (to - from) * random.uniform();
}

/// Stems anywhere in a rectangle, on ground that rolls by a metre.
inline positions random_stems(random_source& random, std::size_t count, double width, double depth) {
  positions stems;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = uniform(random, 0, width), y = uniform(random, 0, depth);
    stems.push_back({x, y, std::sin(x / 5) + 0.5 * std::cos(y / 3)});
  }
  return stems;
}

/// Stems planted in perfect rows, on level ground.
inline positions lattice(int columns, int rows, double spacing) {
  positions stems;
  for (int column = 0; column < columns; ++column)
    for (int row = 0; row < rows; ++row) stems.push_back({column * spacing, row * spacing, 0});
  return stems;
}

inline positions to_positions(const std::vector<vec3>& stems) {
  positions result;
  for (const vec3& p : stems) result.push_back(to_eigen(p));
  return result;
}

/// Each stem moved horizontally by less than `radius` [m].
inline positions jittered(positions stems, double radius, random_source& random) {
  for (Eigen::Vector3d& p : stems) {
    const double distance = radius * std::sqrt(random.uniform());
    const double direction = uniform(random, 0, 2 * std::numbers::pi);
    p += distance * Eigen::Vector3d(std::cos(direction), std::sin(direction), 0);
  }
  return stems;
}

/// Each coordinate with Gaussian noise [m].
inline positions noisy(positions stems, double sigma, random_source& random) {
  for (Eigen::Vector3d& p : stems)
    for (double& coordinate : p) coordinate += sigma * random.normal();
  return stems;
}

inline positions noisy(const std::vector<vec3>& stems, double sigma, random_source& random) {
  return noisy(to_positions(stems), sigma, random);
}

/// What callers and the internals both take.
struct transform_of_scene : Eigen::Isometry3d {
  transform_of_scene() : Eigen::Isometry3d(Eigen::Isometry3d::Identity()) {}
  transform_of_scene(const Eigen::Isometry3d& t) : Eigen::Isometry3d(t) {}
  transform_of_scene(const rigid& t) : Eigen::Isometry3d(to_eigen(t)) {}
  operator rigid() const { return from_eigen(static_cast<const Eigen::Isometry3d&>(*this)); }
};

/// Rotation about the z axis [rad], then translation [m].
inline transform_of_scene yaw_and_shift(double yaw, const Eigen::Vector3d& shift) {
  transform_of_scene transform;
  transform.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  transform.translation() = shift;
  return transform;
}

inline transform_of_scene random_levelled_transform(random_source& random) {
  const double yaw = uniform(random, -std::numbers::pi, std::numbers::pi);
  const double x = uniform(random, -50, 50), y = uniform(random, -50, 50), z = uniform(random, -5, 5);
  return yaw_and_shift(yaw, {x, y, z});
}

inline positions moved(const Eigen::Isometry3d& transform, positions stems) {
  for (Eigen::Vector3d& p : stems) p = transform * p;
  return stems;
}
inline positions moved(const Eigen::Isometry3d& transform, const std::vector<vec3>& stems) {
  return moved(transform, to_positions(stems));
}

/// A random permutation of 0, 1, ..., count - 1.
inline std::vector<std::size_t> random_order(std::size_t count, random_source& random) {
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t(0));
  for (std::size_t i = count; i > 1; --i)
    std::swap(order[i - 1], order[random.below(static_cast<std::uint32_t>(i))]);
  return order;
}

/// The stems that `order` names, in that order.
inline positions reordered(const positions& stems, const std::vector<std::size_t>& order) {
  positions result;
  for (const std::size_t i : order) result.push_back(stems[i]);
  return result;
}

/// A set that keeps the order and the coordinates of `stems`, so that stem i means the same in two maps.
inline position_set set_in_order(const positions& stems) {
  position_set set;
  for (const Eigen::Vector3d& p : stems) set.at.push_back(from_eigen(p));
  set.original.resize(stems.size());
  std::iota(set.original.begin(), set.original.end(), stem_index(0));
  return set;
}

/// The stems of a set, in its frame.
inline positions positions_of(const position_set& set) {
  positions stems;
  for (const vec3& p : set.at) stems.push_back(to_eigen(p));
  return stems;
}

/// Two scans of neighbouring parts of one plot.
struct two_views {
  positions source, target;
  transform_of_scene target_from_source;
};

/// Each view holds `stems` stems on 30 m by 30 m, of which the half that lies in the overlap is in both, with
/// 1 cm of noise; a tenth of those of each view are false.
inline two_views half_overlapping_views(random_source& random, std::size_t stems) {
  constexpr double noise = 0.01;
  const std::size_t half = stems / 2, false_stems = stems / 10;
  const auto strip = [&](double from) {
    return moved(yaw_and_shift(0, {from, 0, 0}), random_stems(random, half, 15, 30));
  };
  const positions left = strip(-15), shared = strip(0), right = strip(15);
  two_views views;
  views.target_from_source = random_levelled_transform(random);
  for (const auto& [view, own] : {std::pair(&views.source, &left), std::pair(&views.target, &right)}) {
    *view = shared;
    view->insert(view->end(), own->begin(), own->end());
    *view = reordered(*view, random_order(view->size(), random));
    for (std::size_t i = 0; i < false_stems; ++i)
      (*view)[i] = Eigen::Vector3d(uniform(random, -15, 30), uniform(random, 0, 30), 0);
    *view = noisy(*view, noise, random);
  }
  views.target = moved(views.target_from_source, views.target);
  return views;
}

/// Largest distance [m] between the stems under two transforms.
inline double max_error(const Eigen::Isometry3d& estimate, const Eigen::Isometry3d& truth,
                        const positions& stems) {
  double largest = 0;
  for (const Eigen::Vector3d& p : stems) largest = std::max(largest, (estimate * p - truth * p).norm());
  return largest;
}
inline double max_error(const rigid& estimate, const Eigen::Isometry3d& truth, const positions& stems) {
  return max_error(to_eigen(estimate), truth, stems);
}
inline double max_error(const rigid& estimate, const Eigen::Isometry3d& truth,
                        const std::vector<vec3>& stems) {
  positions points;
  for (const vec3& p : stems) points.push_back(to_eigen(p));
  return max_error(estimate, truth, points);
}

}  // namespace globalmatch::scenes

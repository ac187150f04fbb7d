// ICP, a small one ([GM] 3.3, after Besl and McKay 1992): fine registration, point to point or point to
// plane. In: samples of both scans and a coarse transform. Out: the refined transform. Parallel over points.
// [GM] gives no values: the options are ours. Cost: iterations times n log n.
#pragma once

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/decompositions.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/neighbor.hpp"
#include "globalmatch/detail/core/neighbors.hpp"
#include "globalmatch/detail/core/rigid_fit.hpp"
#include "globalmatch/detail/core/robust.hpp"
#include "globalmatch/detail/core/small_solver.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch {

enum class icp_metric { none, point_to_point, point_to_plane };

struct icp_options {
  icp_metric metric = icp_metric::point_to_plane;  ///< ([GM] 3.3: point to point)
  double max_distance = 0.3;                       ///< [m] points further apart are no pair
  double trimming = 3;  ///< pairs further apart than so many times their layer's median are dropped
  int max_iterations = 50;
  double convergence_threshold = 1e-4;  ///< [m], [rad] it has converged when a step is smaller
  std::size_t max_points = 50000;       ///< source samples that are used of a layer, evenly picked
  int plane_neighbors = 10;             ///< target samples that make a plane
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const icp_options& options) {
  if (options.metric < icp_metric::none || options.metric > icp_metric::point_to_plane)
    throw std::invalid_argument("icp.metric must be none, point_to_point or point_to_plane");
  if (!(options.max_distance > 0)) throw std::invalid_argument("icp.max_distance must be positive");
  if (!(options.trimming > 0)) throw std::invalid_argument("icp.trimming must be positive");
  if (options.max_iterations < 1) throw std::invalid_argument("icp.max_iterations must be at least 1");
  if (!(options.convergence_threshold > 0))
    throw std::invalid_argument("icp.convergence_threshold must be positive");
  if (options.max_points < 6) throw std::invalid_argument("icp.max_points must be at least 6");
  if (options.plane_neighbors < 3) throw std::invalid_argument("icp.plane_neighbors must be at least 3");
}

/// Samples of one kind of surface in both scans [m]. Points are only paired within their layer, so that dense
/// stems do not crowd out sparse ground.
struct icp_layer {
  std::vector<Eigen::Vector3d> source, target;
  /// Outward unit normals of both, where they are known, or empty. Only points that face the same way are
  /// then paired: two scanners on either side of a stem see different sides of it.
  std::vector<Eigen::Vector3d> source_normals = {}, target_normals = {};
};

struct icp_result {
  Eigen::Isometry3d target_from_source = Eigen::Isometry3d::Identity();
  bool converged = false;  ///< false: too few pairs, or still moving at the last iteration
  int iterations = 0;
  std::size_t pairs = 0;  ///< in the last iteration
  double rms = 0;         ///< [m] distance of these pairs, for planes along the normals and weighted
};

namespace detail {

/// An `icp_layer` as the internals have it.
struct icp_samples {
  std::vector<vec3> source, target, source_normals, target_normals;
};

/// Pairs that a fit needs at least.
inline constexpr std::size_t min_icp_pairs = 6;

/// Calls `work(i)` for all samples of a layer, in parallel; `nearest` is memory of the thread to reuse.
template <class Work>
void for_each_sample(std::size_t count, const execution& exec, const Work& work) {
  parallel_chunks(exec, "icp", count, 1024, [&](std::size_t begin, std::size_t end) {
    std::vector<neighbor<double>> nearest;
    for (std::size_t i = begin; i < end; ++i) work(i, nearest);
  });
}

/// One layer, ready for queries.
struct icp_surface {
  std::vector<vec3> source, source_normals, target, normals;
  bool has_outside;               ///< the normals point outwards
  neighbor_tree<double, 3> tree;  ///< of the target

  icp_surface(icp_samples&& layer, const vec3& origin, const icp_options& options, const execution& exec)
      : target(std::move(layer.target)),
        normals(std::move(layer.target_normals)),
        has_outside(!normals.empty()),
        tree(target.size(), [&](std::size_t i) { return target[i] -= origin; }) {
    const std::size_t step = 1 + (layer.source.size() - 1) / options.max_points;
    for (std::size_t i = 0; i < layer.source.size(); i += step) {
      source.push_back(layer.source[i]);
      if (has_outside) source_normals.push_back(layer.source_normals[i]);
    }
    if (has_outside) return;
    normals.resize(target.size());
    if (options.metric == icp_metric::point_to_plane)
      for_each_sample(target.size(), exec, [&](std::size_t i, std::vector<neighbor<double>>& nearest) {
        tree.nearest({target[i].x, target[i].y, target[i].z}, std::size_t(options.plane_neighbors), nearest);
        normals[i] = normal_of(nearest);
      });
  }

 private:
  /// Unit normal of the plane through some target samples.
  vec3 normal_of(const std::vector<neighbor<double>>& samples) const {
    vec3 mean;
    for (const auto& n : samples) mean += target[n.index] / double(samples.size());
    mat3 covariance;
    for (const auto& n : samples) covariance += outer(target[n.index] - mean, target[n.index] - mean);
    return symmetric_eigen(covariance).vectors.col(0);
  }
};

/// A transformed source sample with its partner in the target, the normal there, and its weight in the fit.
struct icp_pair {
  vec3 transformed, target, normal;
  double weight = 1;

  double off_plane() const { return normal.dot(transformed - target); }
};

/// Weights, from `first` on, by how far pairs lie off their planes: Tukey's, scaled by their median. What
/// stands on the ground is nearer to it than samples lie apart, and would lift it.
inline void weight_by_planes(std::vector<icp_pair>& pairs, std::size_t first) {
  std::vector<double> off;
  for (std::size_t i = first; i < pairs.size(); ++i) off.push_back(std::abs(pairs[i].off_plane()));
  if (off.empty()) return;
  const double limit = tukey_constant * deviation_of_median * median(off);
  for (std::size_t i = first; i < pairs.size() && limit > 0; ++i) {
    const double share = pairs[i].off_plane() / limit;
    pairs[i].weight = tukey_weight(share * share);
  }
}

/// Appends the pairs of one layer: each transformed source point with its nearest target sample, but those
/// too far apart, and those that face other ways.
inline void pair_nearest(const icp_surface& surface, const rigid& target_from_source, const vec3& origin,
                         const icp_options& options, const execution& exec, std::vector<icp_pair>& pairs) {
  constexpr double same_way = 0.5;  // cosine of 60 degrees
  const std::size_t first = pairs.size(), count = surface.source.size();
  std::vector<vec3> transformed(count);
  std::vector<neighbor<double>> nearest_of(count);
  for_each_sample(count, exec, [&](std::size_t i, std::vector<neighbor<double>>& nearest) {
    transformed[i] = target_from_source * surface.source[i] - origin;
    surface.tree.nearest({transformed[i].x, transformed[i].y, transformed[i].z}, 1, nearest);
    nearest_of[i] = nearest.front();
  });
  const auto is_pair = [&](std::size_t i, double squared_limit) {
    return nearest_of[i].squared_distance <= squared_limit &&
           (!surface.has_outside || (target_from_source.rotation * surface.source_normals[i])
                                            .dot(surface.normals[nearest_of[i].index]) > same_way);
  };
  const double max_squared = std::nextafter(options.max_distance * options.max_distance, 0);
  std::vector<double> distances;
  for (std::size_t i = 0; i < count; ++i)
    if (is_pair(i, max_squared)) distances.push_back(std::sqrt(nearest_of[i].squared_distance));
  if (distances.empty()) return;
  const auto middle = distances.begin() + std::ptrdiff_t(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  const double limit = std::min(options.max_distance, options.trimming * *middle);
  for (std::size_t i = 0; i < count; ++i)
    if (const std::size_t to = nearest_of[i].index; is_pair(i, limit * limit))
      pairs.push_back({transformed[i], surface.target[to], surface.normals[to]});
  if (options.metric == icp_metric::point_to_plane) weight_by_planes(pairs, first);
}

/// Small transform that brings the transformed samples nearest to the planes of their partners (linearised
/// rotation), about `center`. 4-DoF turns about z alone.
inline std::optional<rigid> plane_step(const std::vector<icp_pair>& pairs, const vec3& center,
                                       degrees_of_freedom dof) {
  small_matrix normal;
  small_vector right{};
  for (const icp_pair& pair : pairs) {
    const vec3 &n = pair.normal, arm = (pair.transformed - center).cross(n);
    const small_vector row = {arm.x, arm.y, arm.z, n.x, n.y, n.z};
    normal.add_square(row, pair.weight);
    const double scale = pair.weight * pair.off_plane();
    for (std::size_t k = 0; k < 6; ++k) right[k] -= scale * row[k];
  }
  if (dof == degrees_of_freedom::four)
    for (std::size_t k = 0; k < 2; ++k) {
      for (std::size_t j = 0; j < 6; ++j) normal(k, j) = normal(j, k) = j == k ? 1 : 0;
      right[k] = 0;
    }
  const small_solver solver(normal);
  const small_vector step = solver.solve(right);
  const vec3 turn{step[0], step[1], step[2]}, shift{step[3], step[4], step[5]};
  if (!solver.succeeded() || !is_finite(turn) || !is_finite(shift)) return std::nullopt;
  const double angle = turn.norm();
  const mat3 rotation = rotation_about(angle > 0 ? turn.normalized() : vec3{0, 0, 1}, angle);
  return shifted_before(shifted_after({rotation, {}}, center + shift), -center);
}

/// Small transform that brings the transformed samples nearest to their partners.
inline std::optional<rigid> point_step(const std::vector<icp_pair>& pairs, degrees_of_freedom dof) {
  std::vector<vec3> transformed, target;
  for (const icp_pair& pair : pairs) {
    transformed.push_back(pair.transformed);
    target.push_back(pair.target);
  }
  return fit_rigid(transformed, target, dof);
}

/// `refine_by_icp` over what the internals have: valid options, layers that have samples in both scans.
inline icp_result refine_layers(std::vector<icp_samples> layers, rigid target_from_source,
                                degrees_of_freedom dof, const icp_options& options, const execution& exec) {
  const bool planes = options.metric == icp_metric::point_to_plane;
  const vec3 origin = layers.front().target.front();  // small numbers keep the digits
  std::vector<icp_surface> surfaces;
  for (icp_samples& layer : layers) {
    report_progress(exec, "icp", 0);
    surfaces.emplace_back(std::move(layer), origin, options, exec);
  }
  icp_result result;
  while (result.iterations < options.max_iterations && !result.converged) {
    std::vector<icp_pair> pairs;
    for (const icp_surface& surface : surfaces)
      pair_nearest(surface, target_from_source, origin, options, exec, pairs);
    vec3 center;
    double squares = 0, weights = 0;
    std::size_t count = 0;
    for (const icp_pair& pair : pairs) {
      center += pair.transformed / double(pairs.size());
      const double off = pair.off_plane();
      squares += pair.weight * (planes ? off * off : (pair.transformed - pair.target).squared_norm());
      weights += pair.weight;
      count += pair.weight > 0 ? 1 : 0;
    }
    if (count < min_icp_pairs) break;
    const std::optional<rigid> step = planes ? plane_step(pairs, center, dof) : point_step(pairs, dof);
    if (!step) break;
    target_from_source = shifted_before(shifted_after(*step, origin), -origin) * target_from_source;
    result.pairs = count;
    result.rms = std::sqrt(squares / weights);
    ++result.iterations;
    result.converged = (*step * center - center).norm() < options.convergence_threshold &&
                       rotation_angle(step->rotation) < options.convergence_threshold;
  }
  result.target_from_source = to_eigen(target_from_source);
  return result;
}

/// `refine_by_icp` over samples that may be missing in some layers.
inline icp_result refine_samples(std::vector<icp_samples> layers, const rigid& coarse, degrees_of_freedom dof,
                                 const icp_options& options, const execution& exec) {
  require_valid(options);
  if (!is_finite(coarse)) throw std::invalid_argument("coarse must be finite");
  std::erase_if(layers,
                [](const icp_samples& layer) { return layer.source.empty() || layer.target.empty(); });
  if (options.metric != icp_metric::none && !layers.empty()) {
    const parallel_scope scope(exec, "icp");
    return refine_layers(std::move(layers), coarse, dof, options, exec);
  }
  icp_result result;
  result.target_from_source = to_eigen(coarse);
  return result;
}

/// The finite points of a range.
template <point_range R>
std::vector<vec3> finite_points(const R& points) {
  std::vector<vec3> result;
  for (const auto& p : points)
    if (const vec3 v = xyz(p); is_finite(v)) result.push_back(v);
  return result;
}

}  // namespace detail

/// Refines `coarse`, the transform target_from_source, over the layers; points that are not finite are
/// skipped. When fewer than six pairs are left `converged` is false and the transform the last good one.
/// 4-DoF turns about z, so both frames must be level. Throws `std::invalid_argument` for options that make no
/// sense, normals of some points only, and a coarse transform that is not finite.
inline icp_result refine_by_icp(const std::vector<icp_layer>& layers, const Eigen::Isometry3d& coarse,
                                degrees_of_freedom dof, const icp_options& options = {},
                                const execution& exec = {}) {
  // `like`: of points and their normals those go of which the other is not finite.
  const auto copy = [](const std::vector<Eigen::Vector3d>& points, const std::vector<Eigen::Vector3d>& like) {
    std::vector<detail::vec3> result;
    result.reserve(points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
      if (is_finite(detail::from_eigen(points[i])) &&
          (like.empty() || is_finite(detail::from_eigen(like[i]))))
        result.push_back(detail::from_eigen(points[i]));
    return result;
  };
  std::vector<detail::icp_samples> samples;
  for (const icp_layer& l : layers) {
    const bool has_normals = !l.source_normals.empty() || !l.target_normals.empty();
    if (has_normals &&
        (l.source_normals.size() != l.source.size() || l.target_normals.size() != l.target.size()))
      throw std::invalid_argument("layers: normals must be given for all points of both scans, or for none");
    samples.push_back({copy(l.source, l.source_normals), copy(l.target, l.target_normals),
                       copy(l.source_normals, l.source), copy(l.target_normals, l.target)});
  }
  return detail::refine_samples(std::move(samples), detail::from_eigen(coarse), dof, options, exec);
}

/// The same over points of the caller's, as one layer; those that are not finite are skipped.
template <point_range Source, point_range Target>
icp_result refine_by_icp(const Source& source, const Target& target, const Eigen::Isometry3d& coarse,
                         degrees_of_freedom dof, const icp_options& options = {},
                         const execution& exec = {}) {
  std::vector<detail::icp_samples> layers(1);
  layers.front().source = detail::finite_points(source);
  layers.front().target = detail::finite_points(target);
  return detail::refine_samples(std::move(layers), detail::from_eigen(coarse), dof, options, exec);
}

}  // namespace globalmatch

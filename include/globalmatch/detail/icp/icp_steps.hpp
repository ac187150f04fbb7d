// The iterations of ICP: nearest samples are paired, and a step fits these pairs.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
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
#include "globalmatch/detail/icp/icp_uncertainty.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/icp_options.hpp"

namespace globalmatch::detail {

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

  icp_surface(icp_samples&& layer, const vec3& origin, const icp_options& options)
      : target(std::move(layer.target)),
        normals(std::move(layer.target_normals)),
        has_outside(!normals.empty()),
        tree(target.size(), [&](std::size_t i) { return target[i] -= origin; }) {
    const std::size_t step = 1 + (layer.source.size() - 1) / options.max_points;
    for (std::size_t i = 0; i < layer.source.size(); i += step) {
      source.push_back(layer.source[i]);
      if (has_outside) source_normals.push_back(layer.source_normals[i]);
    }
    normals.resize(target.size());
    has_normal_.assign(target.size(), has_outside);
  }

  /// Finds the normals at target samples that have none yet: most are near no source sample, and need none.
  void find_normals(const std::vector<neighbor<double>>& at, std::size_t plane_neighbors,
                    const execution& exec) {
    std::vector<std::size_t> missing;
    for (const neighbor<double>& n : at)
      if (!has_normal_[n.index]) has_normal_[n.index] = true, missing.push_back(n.index);
    for_each_sample(missing.size(), exec, [&](std::size_t i, std::vector<neighbor<double>>& nearest) {
      const vec3& p = target[missing[i]];
      tree.nearest({p.x, p.y, p.z}, plane_neighbors, nearest);
      normals[missing[i]] = normal_of(nearest);
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

  std::vector<std::uint8_t> has_normal_;
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
inline void pair_nearest(icp_surface& surface, const rigid& target_from_source, const vec3& origin,
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
  if (options.metric == icp_metric::point_to_plane)
    surface.find_normals(nearest_of, std::size_t(options.plane_neighbors), exec);
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
                                degrees_of_freedom dof, const icp_options& options, const execution& exec,
                                icp_uncertainty* uncertainty = nullptr) {
  const bool planes = options.metric == icp_metric::point_to_plane;
  const vec3 origin = layers.front().target.front();  // small numbers keep the digits
  std::vector<icp_surface> surfaces;
  for (icp_samples& layer : layers) {
    report_progress(exec, "icp", 0);
    surfaces.emplace_back(std::move(layer), origin, options);
  }
  icp_result result;
  std::vector<icp_pair> pairs;
  const auto pair_all = [&] {
    pairs.clear();
    for (icp_surface& surface : surfaces)
      pair_nearest(surface, target_from_source, origin, options, exec, pairs);
  };
  while (result.iterations < options.max_iterations && !result.converged) {
    pair_all();
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
  if (uncertainty && result.converged) {
    pair_all();
    *uncertainty = uncertainty_of_fit(pairs, dof, options.metric);
    uncertainty->center += origin;
  }
  return result;
}

}  // namespace globalmatch::detail

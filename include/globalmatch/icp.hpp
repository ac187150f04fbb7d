// ICP, a small one ([GM] 3.3, after Besl and McKay 1992): fine registration, point to point or point to
// plane. In: samples of both scans and a coarse motion. Out: the refined motion. Parallel over points. [GM]
// gives no values: the options are ours. Cost: iterations times n log n.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/neighbor.hpp"
#include "globalmatch/detail/core/neighbors.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/transform.hpp"

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
  if (!(options.convergence_threshold > 0)) throw std::invalid_argument("icp.still must be positive");
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
/// Unit normals of the surface around each target sample.
inline std::vector<Eigen::Vector3d> sample_normals(const std::vector<Eigen::Vector3d>& samples,
                                                   const detail::neighbor_tree<double, 3>& tree,
                                                   int neighbors, const execution& exec) {
  std::vector<Eigen::Vector3d> normals(samples.size());
  detail::parallel_chunks(exec, "icp", samples.size(), 1024, [&](std::size_t begin, std::size_t end) {
    std::vector<detail::neighbor<double>> nearest;
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3d& p = samples[i];
      tree.nearest({p.x(), p.y(), p.z()}, std::size_t(neighbors), nearest);
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (const auto& n : nearest) mean += samples[n.index] / double(nearest.size());
      Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
      for (const auto& n : nearest)
        covariance += (samples[n.index] - mean) * (samples[n.index] - mean).transpose();
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
      solver.computeDirect(covariance);
      normals[i] = solver.eigenvectors().col(0);
    }
  });
  return normals;
}

/// One layer, ready for queries.
struct icp_surface {
  std::vector<Eigen::Vector3d> source, source_normals, target, normals;
  bool faces;                             // the normals point outwards
  detail::neighbor_tree<double, 3> tree;  // of the target

  icp_surface(icp_layer& layer, const Eigen::Vector3d& origin, const icp_options& options,
              const execution& exec)
      : target(std::move(layer.target)),
        faces(!layer.target_normals.empty()),
        tree(target.size(), [&](std::size_t i) { return target[i] -= origin; }) {
    const std::size_t step = (layer.source.size() + options.max_points - 1) / options.max_points;
    for (std::size_t i = 0; i < layer.source.size(); i += step) {
      source.push_back(layer.source[i]);
      if (faces) source_normals.push_back(layer.source_normals[i]);
    }
    if (faces)
      normals = std::move(layer.target_normals);
    else if (options.metric == icp_metric::point_to_plane)
      normals = sample_normals(target, tree, options.plane_neighbors, exec);
    else
      normals.resize(target.size());
  }
};

/// Moved source samples, each with its partner in the target, its normal there, and its weight in the fit.
struct icp_pairs {
  std::vector<Eigen::Vector3d> transformed, target, normals;
  std::vector<double> weights;

  double off_plane(std::size_t i) const { return normals[i].dot(transformed[i] - target[i]); }
};

/// Weights, from one on, by how far pairs lie off their planes: Tukey's, as in `robust_fit.hpp`. What stands
/// on the ground is nearer to it than samples lie apart, and would lift it.
inline void weight_by_planes(icp_pairs& pairs, std::size_t first) {
  constexpr double usual = 4.685, deviation_of_median = 1.4826;
  std::vector<double> off;
  for (std::size_t i = first; i < pairs.transformed.size(); ++i) off.push_back(std::abs(pairs.off_plane(i)));
  if (off.empty()) return;
  const double limit = usual * deviation_of_median * detail::median(off);
  for (std::size_t i = first; i < pairs.transformed.size() && limit > 0; ++i) {
    const double share = pairs.off_plane(i) / limit;
    pairs.weights[i] = std::abs(share) < 1 ? std::pow(1 - share * share, 2) : 0;
  }
}

/// Small motion that brings the moved samples nearest to the planes of their partners (linearised rotation),
/// about `center`. 4-DoF turns about z alone.
inline std::optional<Eigen::Isometry3d> plane_step(const icp_pairs& pairs, const Eigen::Vector3d& center,
                                                   degrees_of_freedom dof) {
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
  for (std::size_t i = 0; i < pairs.transformed.size(); ++i) {
    Eigen::Matrix<double, 6, 1> row;
    row << (pairs.transformed[i] - center).cross(pairs.normals[i]), pairs.normals[i];
    normal += pairs.weights[i] * row * row.transpose();
    right -= pairs.weights[i] * pairs.off_plane(i) * row;
  }
  if (dof == degrees_of_freedom::four) {
    normal.topRows<2>().setZero();
    normal.leftCols<2>().setZero();
    normal.topLeftCorner<2, 2>().setIdentity();
    right.head<2>().setZero();
  }
  const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> solver(normal);
  const Eigen::Matrix<double, 6, 1> step = solver.solve(right);
  if (solver.info() != Eigen::Success || !step.allFinite()) return std::nullopt;
  const Eigen::Vector3d turn = step.head<3>();
  const Eigen::AngleAxisd rotation(turn.norm(),
                                   turn.norm() > 0 ? turn.normalized() : Eigen::Vector3d::UnitZ());
  return Eigen::Translation3d(center + step.tail<3>()) * rotation * Eigen::Translation3d(-center);
}

/// Appends the pairs of one layer: each moved source point with its nearest target sample, but those too far
/// apart.
inline void pair_nearest(const icp_surface& surface, const Eigen::Isometry3d& target_from_source,
                         const Eigen::Vector3d& origin, const icp_options& options, const execution& exec,
                         icp_pairs& pairs) {
  const std::size_t first = pairs.transformed.size();
  std::vector<Eigen::Vector3d> transformed(surface.source.size());
  std::vector<detail::neighbor<double>> nearest_of(surface.source.size());
  detail::parallel_chunks(exec, "icp", transformed.size(), 1024, [&](std::size_t begin, std::size_t end) {
    std::vector<detail::neighbor<double>> nearest;
    for (std::size_t i = begin; i < end; ++i) {
      transformed[i] = target_from_source * surface.source[i] - origin;
      surface.tree.nearest({transformed[i].x(), transformed[i].y(), transformed[i].z()}, 1, nearest);
      nearest_of[i] = nearest.front();
    }
  });
  constexpr double same_way = 0.5;  // cosine of 60 degrees
  const auto face_the_same_way = [&](std::size_t i) {
    return !surface.faces || (target_from_source.linear() * surface.source_normals[i])
                                     .dot(surface.normals[nearest_of[i].index]) > same_way;
  };
  std::vector<double> distances;
  for (std::size_t i = 0; i < transformed.size(); ++i)
    if (nearest_of[i].squared_distance < options.max_distance * options.max_distance && face_the_same_way(i))
      distances.push_back(std::sqrt(nearest_of[i].squared_distance));
  if (distances.empty()) return;
  const auto middle = distances.begin() + std::ptrdiff_t(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  const double limit = std::min(options.max_distance, options.trimming * *middle);
  for (std::size_t i = 0; i < transformed.size(); ++i) {
    if (nearest_of[i].squared_distance > limit * limit || !face_the_same_way(i)) continue;
    pairs.transformed.push_back(transformed[i]);
    pairs.target.push_back(surface.target[nearest_of[i].index]);
    pairs.normals.push_back(surface.normals[nearest_of[i].index]);
    pairs.weights.push_back(1);
  }
  if (options.metric == icp_metric::point_to_plane) weight_by_planes(pairs, first);
}
}  // namespace detail

/// Refines `coarse`, the motion target_from_source, over the layers. When fewer than six pairs are left
/// `converged` is false and the motion the last good one. 4-DoF turns about z, so both frames must be level.
inline icp_result refine_by_icp(std::vector<icp_layer> layers, const Eigen::Isometry3d& coarse,
                                degrees_of_freedom dof, const icp_options& options = {},
                                const execution& exec = {}) {
  require_valid(options);
  if (!coarse.matrix().allFinite()) throw std::invalid_argument("coarse must be finite");
  icp_result result;
  result.target_from_source = coarse;
  for (const icp_layer& layer : layers)
    if (layer.source_normals.empty() != layer.target_normals.empty() ||
        (!layer.source_normals.empty() && (layer.source_normals.size() != layer.source.size() ||
                                           layer.target_normals.size() != layer.target.size())))
      throw std::invalid_argument("layers: normals must be given for all points of both scans, or for none");
  std::erase_if(layers, [](const icp_layer& layer) { return layer.source.empty() || layer.target.empty(); });
  if (options.metric == icp_metric::none || layers.empty()) return result;
  const bool planes = options.metric == icp_metric::point_to_plane;
  const Eigen::Vector3d origin = layers.front().target.front();  // small numbers keep the digits
  std::vector<detail::icp_surface> surfaces;
  for (icp_layer& layer : layers) {
    detail::report_progress(exec, "icp", 0);
    surfaces.emplace_back(layer, origin, options, exec);
  }

  while (result.iterations < options.max_iterations && !result.converged) {
    detail::icp_pairs pairs;
    for (const detail::icp_surface& surface : surfaces)
      detail::pair_nearest(surface, result.target_from_source, origin, options, exec, pairs);
    const auto count = std::size_t(
        std::count_if(pairs.weights.begin(), pairs.weights.end(), [](double weight) { return weight > 0; }));
    if (count < 6) return result;
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    double squares = 0, weights = 0;
    for (std::size_t i = 0; i < pairs.transformed.size(); ++i) {
      center += pairs.transformed[i] / double(pairs.transformed.size());
      squares += pairs.weights[i] * (planes ? std::pow(pairs.off_plane(i), 2)
                                            : (pairs.transformed[i] - pairs.target[i]).squaredNorm());
      weights += pairs.weights[i];
    }
    const auto transform =
        planes ? detail::plane_step(pairs, center, dof) : fit_transform(pairs.transformed, pairs.target, dof);
    if (!transform) return result;
    result.target_from_source =
        Eigen::Translation3d(origin) * *transform * Eigen::Translation3d(-origin) * result.target_from_source;
    result.pairs = count;
    result.rms = std::sqrt(squares / weights);
    ++result.iterations;
    const double shift = (*transform * center - center).norm();
    const double turn = Eigen::AngleAxisd(transform->linear()).angle();
    result.converged = shift < options.convergence_threshold && turn < options.convergence_threshold;
  }
  return result;
}

/// The same over points of the caller's, as one layer; those that are not finite are skipped.
template <point_range Source, point_range Target>
icp_result refine_by_icp(const Source& source, const Target& target, const Eigen::Isometry3d& coarse,
                         degrees_of_freedom dof, const icp_options& options = {},
                         const execution& exec = {}) {
  icp_layer layer;
  detail::for_each_finite(source, [&](const Eigen::Vector3d& p, point_index) { layer.source.push_back(p); });
  detail::for_each_finite(target, [&](const Eigen::Vector3d& p, point_index) { layer.target.push_back(p); });
  return refine_by_icp(std::vector{std::move(layer)}, coarse, dof, options, exec);
}
}  // namespace globalmatch

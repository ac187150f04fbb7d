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

#include "globalmatch/execution.hpp"
#include "globalmatch/neighbors.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/transform.hpp"

namespace globalmatch {

enum class icp_metric { none, point_to_point, point_to_plane };

struct icp_options {
  icp_metric metric = icp_metric::point_to_point;
  double largest_distance = 0.3;  ///< [m] points further apart are no pair
  double trimming = 3;            ///< pairs further apart than so many times the median are dropped
  int most_iterations = 50;
  double still = 1e-5;              ///< [m], [rad] it has converged when a step is smaller
  std::size_t most_points = 50000;  ///< source samples that are used, evenly picked
  int plane_neighbors = 10;         ///< target samples that make a plane
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const icp_options& options) {
  if (!(options.largest_distance > 0)) throw std::invalid_argument("icp.largest_distance must be positive");
  if (!(options.trimming > 0)) throw std::invalid_argument("icp.trimming must be positive");
  if (options.most_iterations < 1) throw std::invalid_argument("icp.most_iterations must be at least 1");
  if (!(options.still > 0)) throw std::invalid_argument("icp.still must be positive");
  if (options.most_points < 6) throw std::invalid_argument("icp.most_points must be at least 6");
  if (options.plane_neighbors < 3) throw std::invalid_argument("icp.plane_neighbors must be at least 3");
}

struct icp_result {
  Eigen::Isometry3d target_from_source = Eigen::Isometry3d::Identity();
  bool converged = false;  ///< false: too few pairs, or still moving at the last iteration
  int iterations = 0;
  std::size_t pairs = 0;  ///< in the last iteration
  double rms = 0;         ///< [m] distance of these pairs, along the normals for planes
};

namespace detail {

struct icp_pair {
  std::size_t source;
  std::uint32_t target;
  double distance;
};

/// Unit normals of the surface around each target sample.
inline std::vector<Eigen::Vector3d> sample_normals(const std::vector<Eigen::Vector3d>& samples,
                                                   const neighbor_tree<double, 3>& tree, int neighbors) {
  std::vector<Eigen::Vector3d> normals;
  std::vector<neighbor<double>> nearest;
  for (const Eigen::Vector3d& p : samples) {
    tree.nearest({p.x(), p.y(), p.z()}, std::size_t(neighbors), nearest);
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const auto& n : nearest) mean += samples[n.index] / double(nearest.size());
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (const auto& n : nearest)
      covariance += (samples[n.index] - mean) * (samples[n.index] - mean).transpose();
    normals.push_back(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvectors().col(0));
  }
  return normals;
}

/// Small motion that brings `moved` nearest to the planes through `target` along `normals` (linearised
/// rotation), about `center`. 4-DoF turns about z alone.
inline std::optional<Eigen::Isometry3d> plane_step(const std::vector<Eigen::Vector3d>& moved,
                                                   const std::vector<Eigen::Vector3d>& target,
                                                   const std::vector<Eigen::Vector3d>& normals,
                                                   const Eigen::Vector3d& center, degrees_of_freedom dof) {
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
  for (std::size_t i = 0; i < moved.size(); ++i) {
    Eigen::Matrix<double, 6, 1> row;
    row << (moved[i] - center).cross(normals[i]), normals[i];
    normal += row * row.transpose();
    right += row * normals[i].dot(target[i] - moved[i]);
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

}  // namespace detail

namespace detail {
inline namespace GLOBALMATCH_THREADING {

/// Pairs each moved point with its nearest target sample; those too far apart are dropped.
inline std::vector<icp_pair> nearest_pairs(const std::vector<Eigen::Vector3d>& moved,
                                           const neighbor_tree<double, 3>& target, const icp_options& options,
                                           const execution& how) {
  std::vector<neighbor<double>> nearest_of(moved.size());
  parallel_chunks(how, "icp", moved.size(), 1024, [&](std::size_t begin, std::size_t end) {
    std::vector<neighbor<double>> nearest;
    for (std::size_t i = begin; i < end; ++i) {
      target.nearest({moved[i].x(), moved[i].y(), moved[i].z()}, 1, nearest);
      nearest_of[i] = nearest.front();
    }
  });
  std::vector<icp_pair> pairs;
  for (std::size_t i = 0; i < moved.size(); ++i) {
    const double distance = std::sqrt(nearest_of[i].squared_distance);
    if (distance < options.largest_distance) pairs.push_back({i, nearest_of[i].index, distance});
  }
  if (pairs.empty()) return pairs;
  std::vector<double> distances;
  for (const icp_pair& pair : pairs) distances.push_back(pair.distance);
  const auto middle = distances.begin() + std::ptrdiff_t(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  std::erase_if(pairs,
                [limit = options.trimming * *middle](const icp_pair& pair) { return pair.distance > limit; });
  return pairs;
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace detail

inline namespace GLOBALMATCH_THREADING {

/// Refines `coarse`, the motion target_from_source, over samples of both scans [m]. When fewer than six pairs
/// are left `converged` is false and the motion the last good one. 4-DoF turns about z, so both frames must
/// be level.
template <point_range Source, point_range Target>
icp_result refine_by_icp(const Source& source, const Target& target, const Eigen::Isometry3d& coarse,
                         degrees_of_freedom dof, const icp_options& options = {}, const execution& how = {}) {
  require_valid(options);
  icp_result result;
  result.target_from_source = coarse;
  if (options.metric == icp_metric::none) return result;

  std::vector<Eigen::Vector3d> from, onto;
  for (const auto& p : source) from.push_back(xyz(p));
  for (const auto& p : target) onto.push_back(xyz(p));
  if (from.size() < 6 || onto.size() < 6) return result;
  const std::size_t step = (from.size() + options.most_points - 1) / options.most_points;
  for (std::size_t i = 0; i * step < from.size(); ++i) from[i] = from[i * step];
  from.resize((from.size() + step - 1) / step);
  const Eigen::Vector3d origin = onto.front();  // small numbers keep the digits
  for (Eigen::Vector3d& p : onto) p -= origin;
  const neighbor_tree<double, 3> tree(onto.size(), [&](std::size_t i) { return onto[i]; });
  const bool planes = options.metric == icp_metric::point_to_plane;
  const auto normals = planes ? detail::sample_normals(onto, tree, options.plane_neighbors)
                              : std::vector<Eigen::Vector3d>(onto.size());

  while (result.iterations < options.most_iterations && !result.converged) {
    std::vector<Eigen::Vector3d> moved;
    for (const Eigen::Vector3d& p : from) moved.push_back(result.target_from_source * p - origin);
    const auto pairs = detail::nearest_pairs(moved, tree, options, how);
    if (pairs.size() < 6) return result;

    std::vector<Eigen::Vector3d> paired, partners, partner_normals;
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    double squares = 0;
    for (const auto& pair : pairs) {
      paired.push_back(moved[pair.source]);
      partners.push_back(onto[pair.target]);
      partner_normals.push_back(normals[pair.target]);
      center += paired.back() / double(pairs.size());
      squares += planes ? std::pow(partner_normals.back().dot(paired.back() - partners.back()), 2)
                        : pair.distance * pair.distance;
    }
    const auto motion = planes ? detail::plane_step(paired, partners, partner_normals, center, dof)
                               : fit_transform(paired, partners, dof);
    if (!motion) return result;
    result.target_from_source =
        Eigen::Translation3d(origin) * *motion * Eigen::Translation3d(-origin) * result.target_from_source;
    result.pairs = pairs.size();
    result.rms = std::sqrt(squares / double(pairs.size()));
    ++result.iterations;
    const double shift = (*motion * center - center).norm();
    const double turn = Eigen::AngleAxisd(motion->linear()).angle();
    result.converged = shift < options.still && turn < options.still;
  }
  return result;
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace globalmatch

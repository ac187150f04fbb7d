// What a fine registration takes and returns ([GM] 3.3): options, layers of samples, result. [GM] gives no
// values: the options are ours.
#pragma once

#include <Eigen/Geometry>

#include <cstddef>
#include <stdexcept>
#include <vector>

#include "globalmatch/detail/core/small_solver.hpp"
#include "globalmatch/detail/core/vectors.hpp"

namespace globalmatch {

/// What ICP minimises between paired points; none: the coarse transform is the result.
enum class icp_metric { none, point_to_point, point_to_plane };

/// Options of the fine registration ([GM] 3.3).
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
  std::vector<Eigen::Vector3d> source, target;  ///< [m] each in the frame of its scan
  /// Outward unit normals of both, where they are known, or empty. Only points that face the same way are
  /// then paired: two scanners on either side of a stem see different sides of it.
  std::vector<Eigen::Vector3d> source_normals = {}, target_normals = {};
};

/// What came of the fine registration.
struct icp_result {
  Eigen::Isometry3d target_from_source = Eigen::Isometry3d::Identity();  ///< where it ended
  bool converged = false;  ///< false: too few pairs, or still moving at the last iteration
  int iterations = 0;      ///< that were done
  std::size_t pairs = 0;   ///< in the last iteration
  double rms = 0;          ///< [m] distance of these pairs, for planes along the normals and weighted
};

namespace detail {

/// An `icp_layer` as the internals have it.
struct icp_samples {
  std::vector<vec3> source, target, source_normals, target_normals;
};

/// Uncertainty of a fine registration, in the frame of the target.
struct icp_uncertainty {
  bool is_determined = false;  ///< otherwise there is none: too few places have pairs
  vec3 center;                 ///< [m] centroid of the pairs
  small_matrix covariance;     ///< of x, y, z [m] and the turns about `center` [rad]; 4 x 4 or 6 x 6
};

}  // namespace detail

}  // namespace globalmatch

// One fine registration of two scans by one method: what came out, what it cost. Preparing the scans
// (thinning, trees, normals) counts, and is shown apart.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "cpu_seconds.hpp"

namespace globalmatch::benchmarks {

struct used_time {
  double cpu = 0, wall = 0;  ///< [s]
};

template <class Work>
used_time measure(const Work& work) {
  const double cpu = cpu_seconds();
  const auto start = std::chrono::steady_clock::now();
  work();
  return {cpu_seconds() - cpu,
          std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()};
}

/// Two scans, each in its own frame, and where ICP begins.
struct scan_pair {
  const std::vector<Eigen::Vector3d>& source;
  const std::vector<Eigen::Vector3d>& target;
  Eigen::Isometry3d coarse;
};

struct icp_trial {
  Eigen::Isometry3d target_from_source = Eigen::Isometry3d::Identity();
  int iterations = 0;
  bool converged = false;
  used_time preparation, refinement;
};

struct icp_method {
  std::string name;
  std::function<icp_trial(const scan_pair&)> run;
};

/// What ICP over thinned points is given.
struct peer_settings {
  double voxel = 0.25;      ///< [m] one point of it is kept
  double max_distance = 1;  ///< [m] points further apart are no pair
  int max_iterations = 20;
  double min_step = 1e-3, min_turn = 1.745e-3;  ///< [m], [rad] it has converged when a step is smaller
  int threads = 1;
};

}  // namespace globalmatch::benchmarks

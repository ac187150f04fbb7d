// The ICPs of small_gicp (Koide 2024, JOSS 9), if it is used: prepared and run as its helper does
// (`preprocess_points`, `align`), less what a method does not need.
#pragma once

#include "icp_trial.hpp"

#ifdef GLOBALMATCH_BENCHMARK_SMALL_GICP
#include <small_gicp/ann/gaussian_voxelmap.hpp>
#include <small_gicp/ann/kdtree_omp.hpp>
#include <small_gicp/registration/registration_helper.hpp>
#include <small_gicp/util/downsampling.hpp>
#include <small_gicp/util/downsampling_omp.hpp>
#include <small_gicp/util/normal_estimation_omp.hpp>
#endif

#include <memory>
#include <string>
#include <vector>

namespace globalmatch::benchmarks {

#ifdef GLOBALMATCH_BENCHMARK_SMALL_GICP

namespace small_gicp_detail {

using cloud = small_gicp::PointCloud;
using tree = small_gicp::KdTree<cloud>;
using setting = small_gicp::RegistrationSetting;

inline cloud::Ptr thinned(const std::vector<Eigen::Vector3d>& scan, const peer_settings& settings) {
  const cloud all(scan);
  return settings.threads == 1 ? small_gicp::voxelgrid_sampling(all, settings.voxel)
                               : small_gicp::voxelgrid_sampling_omp(all, settings.voxel, settings.threads);
}

inline icp_trial run(setting::RegistrationType type, const scan_pair& scans, const peer_settings& settings) {
  constexpr int neighbors = 10;  // as its helper
  const setting asked{.type = type,
                      .max_correspondence_distance = settings.max_distance,
                      .rotation_eps = settings.min_turn,
                      .translation_eps = settings.min_step,
                      .num_threads = settings.threads,
                      .max_iterations = settings.max_iterations};
  icp_trial trial;
  cloud::Ptr source, target;
  std::shared_ptr<tree> of_target;
  small_gicp::GaussianVoxelMap::Ptr voxels;
  trial.preparation = measure([&] {
    source = thinned(scans.source, settings);
    target = thinned(scans.target, settings);
    of_target = std::make_shared<tree>(target, small_gicp::KdTreeBuilderOMP(settings.threads));
    if (type != setting::ICP)
      small_gicp::estimate_normals_covariances_omp(*target, *of_target, neighbors, settings.threads);
    if (type == setting::GICP || type == setting::VGICP)
      small_gicp::estimate_covariances_omp(*source, neighbors, settings.threads);
    if (type == setting::VGICP)
      voxels = small_gicp::create_gaussian_voxelmap(*target, asked.voxel_resolution);
  });
  small_gicp::RegistrationResult result;
  trial.refinement = measure([&] {
    result = type == setting::VGICP ? small_gicp::align(*voxels, *source, scans.coarse, asked)
                                    : small_gicp::align(*target, *source, *of_target, scans.coarse, asked);
  });
  trial.target_from_source = result.T_target_source;
  trial.iterations = int(result.iterations);
  trial.converged = result.converged;
  return trial;
}

}  // namespace small_gicp_detail

inline std::vector<icp_method> methods_of_small_gicp(const peer_settings& settings,
                                                     const std::string& label) {
  using type = small_gicp_detail::setting;
  const auto method = [&](const char* name, type::RegistrationType t) {
    return icp_method{std::string("small_gicp ") + name + label, [t, settings](const scan_pair& scans) {
                        return small_gicp_detail::run(t, scans, settings);
                      }};
  };
  return {method("ICP", type::ICP), method("PLANE_ICP", type::PLANE_ICP), method("GICP", type::GICP),
          method("VGICP", type::VGICP)};
}

#else

inline std::vector<icp_method> methods_of_small_gicp(const peer_settings&, const std::string&) {
  return {};
}

#endif

}  // namespace globalmatch::benchmarks

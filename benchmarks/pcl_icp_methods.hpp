// The ICPs of PCL, if it is used: point to point, point to plane, and generalized, over one point a voxel.
#pragma once

#include "icp_trial.hpp"

#ifdef GLOBALMATCH_BENCHMARK_PCL
#include <pcl/features/normal_3d_omp.h>
#include <pcl/registration/gicp.h>
#include <pcl/registration/icp.h>
#include <pcl/search/kdtree.h>

#include "pcl_clouds.hpp"
#endif

#include <cmath>
#include <string>
#include <vector>

namespace globalmatch::benchmarks {

#ifdef GLOBALMATCH_BENCHMARK_PCL

namespace pcl_icp_detail {

/// Tells how many iterations it took.
template <class Registration>
struct counted : Registration {
  int iterations() const { return this->nr_iterations_; }
};

/// The thinned scan, with normals where the method needs them.
template <class Point>
typename pcl::PointCloud<Point>::Ptr prepare(const std::vector<Eigen::Vector3d>& scan,
                                             const peer_settings& settings) {
  const pcl_cloud::Ptr thinned = thinned_by_tiles(to_pcl(scan), float(settings.voxel));
  const auto result = pcl::make_shared<pcl::PointCloud<Point>>();
  pcl::copyPointCloud(*thinned, *result);
  if constexpr (pcl::traits::has_normal<Point>::value) {
    constexpr int neighbors = 10;
    pcl::NormalEstimationOMP<pcl::PointXYZ, Point> estimate(static_cast<unsigned>(settings.threads));
    estimate.setInputCloud(thinned);
    estimate.setSearchMethod(pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
    estimate.setKSearch(neighbors);
    estimate.compute(*result);
    pcl::copyPointCloud(*thinned, *result);
  }
  return result;
}

template <class Point, class Registration>
icp_trial run(const scan_pair& scans, const peer_settings& settings) {
  counted<Registration> icp;
  icp.setMaxCorrespondenceDistance(settings.max_distance);
  icp.setMaximumIterations(settings.max_iterations);
  if constexpr (requires { icp.setRotationEpsilon(settings.min_turn); }) {  // generalized
    icp.setTransformationEpsilon(settings.min_step);
    icp.setRotationEpsilon(settings.min_turn);
  } else {
    icp.setTransformationEpsilon(settings.min_step * settings.min_step);
    icp.setTransformationRotationEpsilon(std::cos(settings.min_turn));
  }
  icp_trial trial;
  trial.preparation = measure([&] {
    icp.setInputSource(prepare<Point>(scans.source, settings));
    icp.setInputTarget(prepare<Point>(scans.target, settings));
  });
  pcl::PointCloud<Point> aligned;
  trial.refinement = measure([&] { icp.align(aligned, scans.coarse.matrix().template cast<float>()); });
  trial.target_from_source.matrix() = icp.getFinalTransformation().template cast<double>();
  trial.iterations = icp.iterations();
  trial.converged = icp.hasConverged();
  return trial;
}

}  // namespace pcl_icp_detail

inline std::vector<icp_method> methods_of_pcl(const peer_settings& settings, const std::string& label) {
  using plain = pcl::PointXYZ;
  using with_normal = pcl::PointNormal;
  using pcl_icp_detail::run;
  return {{"PCL ICP" + label,
           [=](const scan_pair& scans) {
             return run<plain, pcl::IterativeClosestPoint<plain, plain>>(scans, settings);
           }},
          {"PCL ICP to planes" + label,
           [=](const scan_pair& scans) {
             using icp = pcl::IterativeClosestPointWithNormals<with_normal, with_normal>;
             return run<with_normal, icp>(scans, settings);
           }},
          {"PCL GICP" + label, [=](const scan_pair& scans) {
             return run<plain, pcl::GeneralizedIterativeClosestPoint<plain, plain>>(scans, settings);
           }}};
}

#else

inline std::vector<icp_method> methods_of_pcl(const peer_settings&, const std::string&) {
  return {};
}

#endif

}  // namespace globalmatch::benchmarks

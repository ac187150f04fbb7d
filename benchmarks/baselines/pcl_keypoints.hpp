// Keypoints of two scans and which of them look alike, put together from PCL's parts as [GM] 5.3 describes
// FMP+BnB: intrinsic shape signatures (Zhong 2009) on a thinned scan, fast point feature histograms (Rusu et
// al. 2009), and mutual nearest neighbours among the histograms. The radii are multiples of the median
// distance between neighbours of the thinned scans: six and four as in PCL's tutorial of ISS, the others
// ours, as is the voxel.
#pragma once

#include <globalmatch/detail/core/statistics.hpp>
#include <globalmatch/points.hpp>

#include <pcl/features/fpfh_omp.h>
#include <pcl/features/normal_3d_omp.h>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/keypoints/iss_3d.h>
#include <pcl/search/kdtree.h>

#include <cmath>
#include <cstddef>
#include <vector>

#include "baselines/yaw_search.hpp"
#include "pcl_clouds.hpp"

namespace globalmatch::benchmarks {

struct keypoint_options {
  double voxel = 0.2;  ///< [m] one point of it is kept; 0.1 takes longer (`plot_1`, seed 1)
  /// In median distances between neighbours of the thinned scan:
  double salient_radius = 6, non_maximum_radius = 4;  ///< of ISS
  double normal_radius = 5, histogram_radius = 12;    ///< of FPFH
  int threads = 1;
};

struct described_keypoints {
  pcl_cloud places;
  pcl::PointCloud<pcl::FPFHSignature33> histograms;
  detail::vec3 origin;  ///< [m] of `places` in the scan
};

namespace keypoint_detail {

using tree = pcl::search::KdTree<pcl::PointXYZ>;

/// Median distance [m] from a point to the nearest other one.
inline double spacing_of(const pcl_cloud::Ptr& cloud, tree& neighbors) {
  std::vector<double> distances;
  pcl::Indices found(2);
  std::vector<float> squared(2);
  for (const pcl::PointXYZ& p : *cloud)
    if (neighbors.nearestKSearch(p, 2, found, squared) == 2) distances.push_back(std::sqrt(squared[1]));
  return detail::median(distances);
}

inline pcl::PointCloud<pcl::Normal>::Ptr normals_of(const pcl_cloud::Ptr& cloud, const tree::Ptr& neighbors,
                                                    double radius, const detail::vec3& scanner, int threads) {
  const auto normals = pcl::make_shared<pcl::PointCloud<pcl::Normal>>();
  pcl::NormalEstimationOMP<pcl::PointXYZ, pcl::Normal> estimate(static_cast<unsigned>(threads));
  estimate.setInputCloud(cloud);
  estimate.setSearchMethod(neighbors);
  estimate.setRadiusSearch(radius);
  estimate.setViewPoint(float(scanner.x), float(scanner.y), float(scanner.z));
  estimate.compute(*normals);
  return normals;
}

}  // namespace keypoint_detail

/// The keypoints of a scan, whose scanner stands at its origin.
template <point_range R>
described_keypoints find_keypoints(const R& scan, const keypoint_options& options) {
  described_keypoints result;
  for (const auto& point : scan)
    if (const detail::vec3 p = xyz(point); is_finite(p)) {
      result.origin = p;  // floats lose the digits of coordinates that are far from zero
      break;
    }
  const auto cloud = thinned_by_tiles(to_pcl(scan, result.origin), float(options.voxel));
  if (cloud->size() < 2) return result;
  const auto neighbors = pcl::make_shared<keypoint_detail::tree>();
  neighbors->setInputCloud(cloud);
  const double spacing = keypoint_detail::spacing_of(cloud, *neighbors);

  pcl::ISSKeypoint3D<pcl::PointXYZ, pcl::PointXYZ> signatures;
  signatures.setNumberOfThreads(static_cast<unsigned>(options.threads));
  signatures.setSearchMethod(neighbors);
  signatures.setSalientRadius(options.salient_radius * spacing);
  signatures.setNonMaxRadius(options.non_maximum_radius * spacing);
  signatures.setInputCloud(cloud);
  signatures.compute(result.places);

  pcl::FPFHEstimationOMP<pcl::PointXYZ, pcl::Normal, pcl::FPFHSignature33> describe(
      static_cast<unsigned>(options.threads));
  describe.setInputCloud(pcl::make_shared<pcl_cloud>(result.places));
  describe.setSearchSurface(cloud);
  describe.setInputNormals(keypoint_detail::normals_of(cloud, neighbors, options.normal_radius * spacing,
                                                       -result.origin, options.threads));
  describe.setSearchMethod(neighbors);
  describe.setRadiusSearch(options.histogram_radius * spacing);
  describe.compute(result.histograms);
  return result;
}

/// The keypoints whose histograms are each other's nearest.
inline std::vector<point_match> match_keypoints(const described_keypoints& source,
                                                const described_keypoints& target) {
  using histograms = pcl::PointCloud<pcl::FPFHSignature33>;
  if (source.places.empty() || target.places.empty()) return {};
  const auto nearest = [](const histograms& of, const histograms& among) {
    pcl::KdTreeFLANN<pcl::FPFHSignature33> tree;
    tree.setInputCloud(pcl::make_shared<histograms>(among));
    std::vector<std::size_t> result;
    pcl::Indices found(1, 0);
    std::vector<float> squared(1);
    for (const pcl::FPFHSignature33& h : of) {
      tree.nearestKSearch(h, 1, found, squared);
      result.push_back(std::size_t(found[0]));
    }
    return result;
  };
  const auto of_source = nearest(source.histograms, target.histograms);
  const auto of_target = nearest(target.histograms, source.histograms);
  const auto place = [](const described_keypoints& keypoints, std::size_t i) {
    const pcl::PointXYZ& p = keypoints.places[i];
    return detail::vec3{p.x, p.y, p.z} + keypoints.origin;
  };
  std::vector<point_match> matches;
  for (std::size_t i = 0; i < of_source.size(); ++i)
    if (of_target[of_source[i]] == i) matches.push_back({place(source, i), place(target, of_source[i])});
  return matches;
}

}  // namespace globalmatch::benchmarks

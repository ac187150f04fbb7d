// The stages of [GM] 3.1 after the ground, put together from PCL's parts: VoxelGrid, NormalEstimationOMP,
// EuclideanClusterExtraction, SACSegmentation. Seconds a stage, beside those of `map_stems` on the same scan.
// Built with GLOBALMATCH_BENCHMARK_PCL.
#include <globalmatch/detail/mapping/cylinder.hpp>
#include <globalmatch/detail/mapping/ground.hpp>
#include <globalmatch/detail/mapping/understory.hpp>
#include <globalmatch/stem_mapping.hpp>

#include <pcl/console/print.h>
#include <pcl/features/normal_3d_omp.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>
#include <pcl/segmentation/sac_segmentation.h>

#include "pcl_clouds.hpp"
#include "support/programs/command_line.hpp"
#include "support/programs/reports.hpp"
#include "support/simulator/scenes.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <map>
#include <string>
#include <utility>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::detail;

namespace {

using benchmarks::thinned_by_tiles;
using cloud = benchmarks::pcl_cloud;
using normals = pcl::PointCloud<pcl::Normal>;

struct stage_times {
  std::map<std::string, double> seconds;
  std::size_t stems = 0;

  template <class Work>
  void measure(const std::string& stage, const Work& work) {
    const auto begin = std::chrono::steady_clock::now();
    work();
    seconds[stage] = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }
  double sum() const {
    double all = 0;
    for (const auto& stage : seconds) all += stage.second;
    return all;
  }
};

cloud cloud_of(const local_points& points) {
  cloud all;
  for (std::size_t i = 0; i < points.size(); ++i) all.emplace_back(points.x[i], points.y[i], points.z[i]);
  return all;
}

/// Cylinders of the clusters, as PCL finds them; those that a stem's limits allow are counted.
std::size_t count_cylinders(const cloud::Ptr& points, const normals::Ptr& around,
                            const std::vector<pcl::PointIndices>& clusters) {
  std::size_t stems = 0;
  for (const pcl::PointIndices& cluster : clusters) {
    pcl::SACSegmentationFromNormals<pcl::PointXYZ, pcl::Normal> fit;
    fit.setModelType(pcl::SACMODEL_CYLINDER);
    fit.setMethodType(pcl::SAC_RANSAC);
    fit.setNormalDistanceWeight(0.1);
    fit.setMaxIterations(300);
    fit.setDistanceThreshold(default_distance_tolerance);
    fit.setRadiusLimits(cylinder_options{}.min_radius, cylinder_options{}.max_radius);
    fit.setInputCloud(points);
    fit.setInputNormals(around);
    fit.setIndices(pcl::make_shared<pcl::Indices>(cluster.indices));
    pcl::PointIndices inliers;
    pcl::ModelCoefficients cylinder;
    fit.segment(inliers, cylinder);
    stems += inliers.indices.size() >= std::size_t(stem_cylinder_options{}.min_points);
  }
  return stems;
}

/// The values are those of the paper; link distance and minimum size of clusters, which it does not give,
/// ours.
stage_times stages_of_pcl(const local_points& understory, int threads) {
  constexpr float voxel = 0.01f, radius = 0.10f, threshold = 0.9f, link = 0.05f;
  stage_times times;
  cloud::Ptr thinned;
  const auto vertical = pcl::make_shared<cloud>();
  const auto around = pcl::make_shared<normals>(), of_vertical = pcl::make_shared<normals>();
  std::vector<pcl::PointIndices> clusters;
  times.measure("voxels", [&] { thinned = thinned_by_tiles(cloud_of(understory), voxel); });
  times.measure("verticality", [&] {
    pcl::NormalEstimationOMP<pcl::PointXYZ, pcl::Normal> estimate(
        static_cast<unsigned>(std::max(threads, 0)));
    estimate.setInputCloud(thinned);
    estimate.setSearchMethod(pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
    estimate.setRadiusSearch(radius);
    estimate.compute(*around);
    for (std::size_t i = 0; i < thinned->size(); ++i)
      if (1 - std::abs((*around)[i].normal_z) > threshold) {
        vertical->push_back((*thinned)[i]);
        of_vertical->push_back((*around)[i]);
      }
  });
  times.measure("clusters", [&] {
    pcl::EuclideanClusterExtraction<pcl::PointXYZ> extract;
    extract.setInputCloud(vertical);
    extract.setClusterTolerance(link);
    extract.setMinClusterSize(stem_cylinder_options{}.min_points);
    extract.extract(clusters);
  });
  times.measure("cylinders", [&] { times.stems = count_cylinders(vertical, of_vertical, clusters); });
  return times;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("The stages of mapping from PCL's parts, beside those of this library.", "pcl_stages");
  std::vector<std::string> names = {"plot_1", "slope_15", "underwood"};
  std::uint64_t seed = 1;
  support::shared_options shared;
  app.add_option("--scenes", names, "names of scenes")->delimiter(',')->capture_default_str();
  app.add_option("--scene-seed", seed, "of the scenes")->capture_default_str();
  shared.add_mapping_to(app);
  shared.add_threads_to(app);

  return support::run_program(app, argc, argv, [&] {
    pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);  // clusters without a cylinder are no errors
    std::cout << "| scene | points [M] | voxels, verticality, clusters, cylinders by PCL [s] | sum [s] | "
                 "cylinders | "
                 "`map_stems`, ground included [s] | stems |\n|---|---|---|---|---|---|---|\n"
              << std::fixed << std::setprecision(2);
    for (const std::string& name : names) {
      support::simulation_options options = support::find_scene(name).options;
      options.seed = seed;
      support::simulation plot(options);
      const execution exec{.threads = shared.threads};
      const auto scan = plot.scan(0, exec);
      support::stage_clock clock;
      const stem_map map = map_stems(scan.points, shared.for_mapping(), Eigen::Vector3d::UnitZ(), exec);
      const double seconds = clock.seconds();
      const stage_times pcl =
          stages_of_pcl(select_understory(scan.points, map.terrain, {}, exec), shared.threads);
      std::cout << "| `" << name << "` | " << double(scan.points.size()) / 1e6 << " | ";
      for (const char* stage : {"voxels", "verticality", "clusters", "cylinders"})
        std::cout << pcl.seconds.at(stage) << (stage == std::string("cylinders") ? " | " : ", ");
      std::cout << pcl.sum() << " | " << pcl.stems << " | " << std::setprecision(3) << seconds
                << std::setprecision(2) << " | " << map.stems.size() << " |\n"
                << std::flush;
    }
    return support::done;
  });
}

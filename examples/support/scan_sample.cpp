#include "support/scan_sample.hpp"

#include <globalmatch/mapping_options.hpp>

#include <algorithm>
#include <cmath>

namespace globalmatch::support {

namespace {

constexpr double understory_voxel = 0.03, section_voxel = 0.015;  // [m]
constexpr std::size_t max_section_points = 8000;                  // more are not seen on paper
constexpr double section_depth = 0.5, section_top = 6;            // [m] below and above the ground

bool is_in(const vertical_section& section, const Eigen::Vector3d& p) {
  return p.x() >= 0 && p.x() <= section.length && std::abs(p.y()) <= section.half_width;
}

}  // namespace

scan_sample sample_of(const scan_file& scan, const terrain& ground, std::size_t max_understory,
                      const std::optional<vertical_section>& section) {
  const understory_options layer;
  voxel_sample understory(understory_voxel, max_understory), along(section_voxel, max_section_points);
  std::vector<Eigen::Vector3d> block(point_source::block_size);
  for (std::size_t first = 0; first < scan.size(); first += block.size()) {
    block.resize(std::min(point_source::block_size, scan.size() - first));
    scan.points().read(first, block);
    for (const Eigen::Vector3d& p : block) {
      if (!p.allFinite()) continue;
      const detail::vec3 local = ground.frame.to_local({p.x(), p.y(), p.z()});
      const auto ground_height = ground.height_at(local.x, local.y);
      if (!ground_height) continue;
      const double height = local.z - *ground_height;
      if (height > layer.min_height && height < layer.max_height) understory.add({p, height});
      if (!section || height < -section_depth || height > section_top) continue;
      const Eigen::Vector3d there = section->section_from_scan * p;
      if (is_in(*section, there)) along.add({there, height});
    }
  }
  return {understory.points(), along.points()};
}

}  // namespace globalmatch::support

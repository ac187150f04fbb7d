// Stem maps with samples of any kind, registered: a transform that is finite, or a reason.
#include <optional>
#include <stdexcept>

#include "fuzz_input.hpp"
#include "globalmatch/registration.hpp"

using namespace globalmatch;

namespace {

/// A map with stems at some places, rings of samples around them, and further samples anywhere.
stem_map map_around(const std::vector<Eigen::Vector3d>& places, fuzz::byte_source& bytes) {
  stem_map map;
  for (const Eigen::Vector3d& p : places) {
    if (!p.allFinite() || p.cwiseAbs().maxCoeff() > 1e6) continue;  // `map_stems` finds no such stems
    stem s;
    s.position = p;
    s.radius = 0.1;
    map.stems.push_back(s);
    for (int i = 0; i < 24; ++i) {
      const Eigen::Vector3d outward(std::cos(0.7 * i), std::sin(0.7 * i), 0);
      map.stem_samples.push_back(p + 0.1 * outward + Eigen::Vector3d(0, 0, 0.1 * i));
      map.stem_normals.push_back(outward);
      map.ground_samples.push_back(p + (0.2 + 0.02 * i) * outward);
    }
  }
  for (const Eigen::Vector3d& p : bytes.positions(16))
    if (p.allFinite()) map.ground_samples.push_back(p);
  map.funnel.stems = map.stems.size();
  return map;
}

/// Gives a map a terrain around the origin, and what a scanner somewhere in it saw.
void add_view(stem_map& map, fuzz::byte_source& bytes) {
  constexpr double half = 64;  // [m]
  map.terrain.frame.origin = {-half, -half, 0};
  map.terrain.resolution = 1;
  map.terrain.columns = map.terrain.rows = int(2 * half);
  map.terrain.heights.assign(std::size_t(4 * half * half), 0);
  map.terrain.has_data.assign(map.terrain.heights.size(), 1);
  map.visible.scanner = {half + bytes.take<std::int8_t>(), half + bytes.take<std::int8_t>(), 1.5};
  constexpr std::size_t cells = std::size_t(detail::visible_ranges::columns * detail::visible_ranges::rows);
  const auto one = bytes.take<std::uint16_t>(), other = bytes.take<std::uint16_t>();
  const std::size_t step = 1 + bytes.take<std::uint8_t>();
  map.visible.ranges.assign(cells, one);
  for (std::size_t i = 0; i < cells; i += step) map.visible.ranges[i] = other;
  for (stem& s : map.stems) s.position_sigma = bytes.choice(8) == 0 ? 1e38 : 0.01;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::byte_source bytes(data, size);
  registration_options options;
  options.icp.metric = bytes.choice(2) == 0 ? icp_metric::point_to_plane : icp_metric::point_to_point;
  if (const auto dof = bytes.choice(4); dof < 2)
    options.matching.dof = dof == 0 ? degrees_of_freedom::six : degrees_of_freedom::four;
  auto places = bytes.positions(32);
  stem_map source = map_around(places, bytes);
  const double yaw = bytes.take<std::uint16_t>() / 1000.0;
  for (Eigen::Vector3d& p : places)
    p = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * p +
        0.001 * Eigen::Vector3d(bytes.take<std::int8_t>(), bytes.take<std::int8_t>(), 0);
  stem_map target = map_around(places, bytes);
  if (bytes.choice(2) == 1) {
    add_view(source, bytes);
    add_view(target, bytes);
  }
  const registration r = register_maps(source, target, options, {.threads = 1});
  fuzz::require((r.outcome == outcome::registered) == r.target_from_source.has_value(),
                "a transform, or none");
  fuzz::require((r.outcome == outcome::registered) == r.reason.empty(), "a reason, or none");
  if (r.target_from_source)
    fuzz::require(r.target_from_source->matrix().allFinite(), "the transform is finite");
  return 0;
}

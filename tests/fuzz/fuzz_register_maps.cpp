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

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::byte_source bytes(data, size);
  registration_options options;
  options.icp.metric = bytes.choice(2) == 0 ? icp_metric::point_to_plane : icp_metric::point_to_point;
  if (const auto dof = bytes.choice(4); dof < 2)
    options.matching.dof = dof == 0 ? degrees_of_freedom::six : degrees_of_freedom::four;
  auto places = bytes.positions(32);
  const stem_map source = map_around(places, bytes);
  const double yaw = bytes.take<std::uint16_t>() / 1000.0;
  for (Eigen::Vector3d& p : places)
    p = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * p +
        0.001 * Eigen::Vector3d(bytes.take<std::int8_t>(), bytes.take<std::int8_t>(), 0);
  const stem_map target = map_around(places, bytes);
  const registration r = register_maps(source, target, options, {.threads = 1});
  fuzz::require((r.outcome == outcome::registered) == r.target_from_source.has_value(),
                "a transform, or none");
  fuzz::require((r.outcome == outcome::registered) == r.reason.empty(), "a reason, or none");
  if (r.target_from_source)
    fuzz::require(r.target_from_source->matrix().allFinite(), "the transform is finite");
  return 0;
}

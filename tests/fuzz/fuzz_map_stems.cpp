// Clouds of any kind: a stem map whose stems are finite and whose funnel narrows.
#include <algorithm>

#include "fuzz_input.hpp"
#include "globalmatch/stem_mapping.hpp"

using namespace globalmatch;
using namespace globalmatch::detail;

namespace {

/// Ground, stems and single points, so that mutations reach the later steps.
std::vector<Eigen::Vector3d> cloud_from(fuzz::byte_source& bytes) {
  std::vector<Eigen::Vector3d> cloud;
  while (!bytes.empty() && cloud.size() < 20000) {
    const unsigned kind = bytes.choice(8);
    const Eigen::Vector3d at = bytes.position();
    if (kind == 0) {  // a patch of ground
      const double slope = bytes.take<std::int8_t>() / 50.0;
      for (int i = 0; i < 400; ++i) {
        const double x = 0.2 * (i % 20), y = 0.2 * (i / 20);
        cloud.push_back(at + Eigen::Vector3d(x, y, slope * x));
      }
    } else if (kind == 1) {  // a stem
      const double radius = bytes.take<std::uint8_t>() / 200.0, lean = bytes.take<std::int8_t>() / 100.0;
      for (int i = 0; i < 400; ++i) {
        const double height = 0.01 * i;
        cloud.push_back(at +
                        Eigen::Vector3d(radius * std::cos(i) + lean * height, radius * std::sin(i), height));
      }
    } else {
      cloud.push_back(at);
    }
  }
  return cloud;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::byte_source bytes(data, size);
  mapping_options options;
  options.verticality.constraint = bytes.choice(4) != 0;
  if (bytes.choice(4) == 0) options.voxel_size = 0.05;
  Eigen::Vector3d up(0, 0, 1);
  if (bytes.choice(4) == 0) up = {0.01 * bytes.take<std::int8_t>(), 0.01 * bytes.take<std::int8_t>(), 0.5};
  const auto cloud = cloud_from(bytes);
  stem_map map;
  try {
    map = map_stems(cloud, options, up, {.threads = 1});
  } catch (const std::invalid_argument&) {
    return 0;  // not in metres
  }
  fuzz::require(map.funnel.ground.points == cloud.size(), "all points are counted");
  fuzz::require(map.funnel.thinned <= map.funnel.understory, "one point a voxel");
  fuzz::require(map.funnel.stems == map.stems.size(), "all stems are counted");
  for (const stem& s : map.stems) {
    fuzz::require(s.position.allFinite(), "stems stand somewhere");
    fuzz::require(s.radius > 0 && std::isfinite(s.radius), "stems are round");
  }
  fuzz::require(map.stem_samples.size() == map.stem_normals.size(), "each sample has a normal");
  return 0;
}

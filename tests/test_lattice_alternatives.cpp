#include "globalmatch/detail/matching/lattice_alternatives.hpp"

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_lattice_alternatives {

using namespace detail;

using scenes::positions;

namespace {

using scenes::four;

local_hypothesis in_place(const matching_context& maps, double inlier_threshold) {
  local_hypothesis h;
  h.inlier_threshold = inlier_threshold;
  h.correspondences = maps.pair_stems(h.target_from_source, inlier_threshold);
  return h;
}

}  // namespace

TEST_CASE("alternatives on a lattice are its shifts, and its turns where it is square") {
  for (const double depth : {3.0, 4.0}) {
    CAPTURE(depth);
    random_source random(1);
    positions rows;
    for (const Eigen::Vector3d& p : scenes::lattice(8, 8, 1)) rows.push_back({3 * p.x(), depth * p.y(), 0});
    const position_set source = scenes::set_in_order(scenes::noisy(rows, 0.01, random));
    const position_set target = scenes::set_in_order(scenes::noisy(rows, 0.01, random));
    const matching_context maps(source, target, true, four);
    const auto alternatives = lattice_alternatives(in_place(maps, 0.1), maps);
    bool shifted = false, turned = false;
    for (const local_hypothesis& alternative : alternatives) {
      const double yaw = std::atan2(alternative.target_from_source.rotation(1, 0),
                                    alternative.target_from_source.rotation(0, 0));
      CHECK(alternative.correspondences.size() >= 16);
      if (std::abs(yaw) < 0.1) {
        const vec2 shift = alternative.target_from_source.translation.xy();
        CHECK(std::abs(std::remainder(shift.x, 3)) < 0.1);
        CHECK(std::abs(std::remainder(shift.y, depth)) < 0.1);
        shifted = shifted || shift.norm() > 1;
      } else {
        CHECK(std::abs(std::remainder(yaw, std::acos(-1.0) / 2)) < 0.1);
        turned = true;
      }
    }
    CHECK(shifted);
    CHECK(turned == (depth == 3.0));
  }
}

TEST_CASE("stems at random have no lattice alternatives") {
  random_source random(2);
  const positions stems = scenes::random_stems(random, 200, 50, 50);
  const position_set map = scenes::set_in_order(stems);
  const matching_context maps(map, map, true, four);
  CHECK(lattice_alternatives(in_place(maps, 0.05), maps).empty());
}

TEST_CASE("a hypothesis without pairs has no lattice alternatives") {
  const position_set none;
  const matching_context maps(none, none, true, four);
  CHECK(lattice_alternatives(local_hypothesis{}, maps).empty());
}

}  // namespace globalmatch::test_lattice_alternatives

#include "globalmatch/lattice_rivals.hpp"

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch {

using scenes::positions;

namespace {

using scenes::four;

hypothesis in_place(const map_pair& maps, double tolerance) {
  hypothesis h;
  h.tolerance = tolerance;
  h.correspondences = maps.pair_stems(h.target_from_source, tolerance);
  return h;
}

}  // namespace

TEST_CASE("rivals of rows are their shifts, and their turns where they are square") {
  for (const double depth : {3.0, 4.0}) {
    CAPTURE(depth);
    random_source random(1);
    positions rows;
    for (const Eigen::Vector3d& p : scenes::lattice(8, 8, 1)) rows.push_back({3 * p.x(), depth * p.y(), 0});
    const position_set source = scenes::set_in_order(scenes::noisy(rows, 0.01, random));
    const position_set target = scenes::set_in_order(scenes::noisy(rows, 0.01, random));
    const map_pair maps(source, target, true, four);
    const auto rivals = lattice_rivals(in_place(maps, 0.1), maps);
    bool shifted = false, turned = false;
    for (const hypothesis& rival : rivals) {
      const double yaw =
          std::atan2(rival.target_from_source.linear()(1, 0), rival.target_from_source.linear()(0, 0));
      CHECK(rival.correspondences.size() >= 16);
      if (std::abs(yaw) < 0.1) {
        const Eigen::Vector2d shift = rival.target_from_source.translation().head<2>();
        CHECK(std::abs(std::remainder(shift.x(), 3)) < 0.1);
        CHECK(std::abs(std::remainder(shift.y(), depth)) < 0.1);
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

TEST_CASE("stems at random have no lattice rivals") {
  random_source random(2);
  const positions stems = scenes::random_stems(random, 200, 50, 50);
  const position_set map = scenes::set_in_order(stems);
  const map_pair maps(map, map, true, four);
  CHECK(lattice_rivals(in_place(maps, 0.05), maps).empty());
}

TEST_CASE("a hypothesis without pairs has no lattice rivals") {
  const position_set none;
  const map_pair maps(none, none, true, four);
  CHECK(lattice_rivals(hypothesis{}, maps).empty());
}

}  // namespace globalmatch

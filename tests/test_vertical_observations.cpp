#include "globalmatch/detail/matching/vertical_observations.hpp"

#include <cmath>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_vertical_observations {

using namespace detail;

TEST_CASE("the rows of all kinds are what a small shift and turn about the center does to stems") {
  random_source random(31);
  scenes::positions stems = scenes::random_stems(random, 12, 40, 25);
  for (Eigen::Vector3d& p : stems) p.z() += 7;
  const scenes::transform_of_scene transform = scenes::yaw_and_shift(0.7, {3, -9, 2});
  const vec3 shift{0.02, -0.03, 0.05}, turn{2e-5, -4e-5, 3e-5};
  position_set source = scenes::set_in_order(stems);
  const rigid before = transform;
  std::vector<correspondence> pairs;
  for (stem_index i = 0; i < stems.size(); ++i) {
    pairs.push_back({i, i});
    source.axis.push_back(vec3{0.1, -0.05, 1}.normalized());
  }
  position_set target = source;
  const matching_context maps(source, target, true, scenes::four);
  const vertical_observations observations(maps, pairs);
  const vec3 center = observations.center(before);
  const rigid turned_about = shifted_before(
      shifted_after({rotation_about(turn.normalized(), turn.norm()), {}}, center + shift), -center);
  for (std::size_t i = 0; i < stems.size(); ++i) {
    target.at[i] = turned_about * (before * source.at[i]);
    target.axis[i] = turned_about.rotation * (before.rotation * source.axis[i]);
  }
  const small_vector parameters = {shift.x, shift.y, shift.z, turn.x, turn.y, turn.z};
  for (const observation_kind& kind :
       {observations.positions(before, center, true), observations.heights(before, center, true)})
    for (const observation& o : kind.of) CHECK(kind.squared_residual(o, parameters) < 1e-14);
  const observation_kind axes = observations.axes(before, true);
  REQUIRE(axes.of.size() == stems.size());
  for (const observation& o : axes.of) CHECK(std::sqrt(axes.squared_residual(o, parameters)) < 6e-6);
  // without tilts a turn about the vertical and a shift are all there is
  for (const observation_kind& kind :
       {observations.positions(before, center, false), observations.heights(before, center, false)})
    for (const observation& o : kind.of)
      for (const observed_coordinate& c : o.coordinates) CHECK((c.row[3] == 0 && c.row[4] == 0));
}

TEST_CASE("relative sigmas are 1 for the median, and at most so much smaller for what is certain") {
  const auto sigmas = relative_sigmas({0.04, 0.04, 0.0, 0.64, 0.04});
  CHECK(sigmas[0] == Approx(1));
  CHECK(sigmas[2] == Approx(std::sqrt(0.5)));
  CHECK(sigmas[3] == Approx(std::sqrt(0.68 / 0.08)));
  CHECK(relative_sigmas({0, 0, 0}) == std::vector<double>(3, 1.0));
  CHECK(relative_sigmas({}).empty());
}

}  // namespace globalmatch::test_vertical_observations

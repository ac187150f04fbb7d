#include "globalmatch/detail/matching/ground_offset.hpp"

#include <cmath>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_ground_offset {

using namespace detail;

namespace {

using scenes::uniform;

double rolling(double x, double y) {
  return 0.4 * x + std::sin(x / 6) + 0.5 * std::cos(y / 4);
}

/// Ground points in a rectangle, raised, some of them hanging higher.
std::vector<vec3> ground(random_source& random, std::size_t count, double left, double right, double raised,
                         double noise, double hanging = 0) {
  std::vector<vec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = uniform(random, left, right), y = uniform(random, -30, 10);
    const double above = random.uniform() < hanging ? uniform(random, 0.2, 1.5) : 0;
    points.push_back({x, y, rolling(x, y) + raised + above + noise * random.normal()});
  }
  return points;
}

}  // namespace

TEST_CASE("the offset of ground that two scans see in different points is found to millimetres") {
  for (const double offset : {-1.3, 0.0, 0.02, 6.0}) {
    random_source random(7);
    const auto source = ground(random, 20000, -10, 25, 3, 0.02),
               target = ground(random, 20000, 5, 45, 3 + offset, 0.02);
    const auto found = find_ground_offset(source, target);
    REQUIRE(found);
    CHECK(found->offset == Approx(offset).margin(0.004));
    CHECK(found->sigma > 0);
    CHECK(found->sigma < 0.01);
  }
}

TEST_CASE("the error of the offset is what its sigma says") {
  double squares = 0;
  constexpr int trials = 40;
  for (int i = 0; i < trials; ++i) {
    random_source random(std::uint64_t(100 + i));
    const auto found =
        find_ground_offset(ground(random, 3000, -5, 15, 0, 0.05), ground(random, 3000, 0, 20, 0.5, 0.05));
    REQUIRE(found);
    squares += std::pow((found->offset - 0.5) / found->sigma, 2);
  }
  CHECK(std::sqrt(squares / trials) > 0.6);
  CHECK(std::sqrt(squares / trials) < 1.4);
}

TEST_CASE("what hangs over the ground in one scan does not lift it") {
  random_source random(9);
  const auto found = find_ground_offset(ground(random, 20000, -10, 25, 0, 0.02, 0.05),
                                        ground(random, 20000, 5, 45, -0.7, 0.02));
  REQUIRE(found);
  CHECK(found->offset == Approx(-0.7).margin(0.05));
}

TEST_CASE("ground that is seen by one scan only, or in a few points, has no offset") {
  random_source random(4);
  const auto here = ground(random, 5000, -10, 10, 0, 0.02);
  CHECK_FALSE(find_ground_offset(here, ground(random, 5000, 20, 40, 0, 0.02)));
  CHECK_FALSE(find_ground_offset(here, ground(random, 60, -10, 10, 0, 0.02)));
  CHECK_FALSE(find_ground_offset(here, {}));
  CHECK_FALSE(find_ground_offset({}, here));
}

TEST_CASE("blocks that agree on nothing have no offset, and few that agree are enough") {
  CHECK_FALSE(mode_of_offsets({}));
  CHECK_FALSE(mode_of_offsets({0.5, 0.52}));
  CHECK_FALSE(mode_of_offsets({-3, -1, 0.5, 2, 4}));
  CHECK_FALSE(mode_of_offsets({0.5, 0.52, 0.54, 3.0, 3.1}));  // 3 to 2
  const auto found = mode_of_offsets({0.54, 9, 0.50, 0.52});
  REQUIRE(found);
  CHECK(found->offset == Approx(0.52));
}

TEST_CASE("planes have a height at places next to ground points, not in a hole or beyond") {
  std::vector<vec3> ring;  // around (10, 3)
  for (int i = 0; i < 200; ++i) {
    const double angle = 0.1 * i, radius = 0.45 + 0.001 * i;
    ring.push_back({10 + radius * std::cos(angle), 3 + radius * std::sin(angle), 0.2});
  }
  const ground_planes planes(ring);
  CHECK_FALSE(planes.height_at(10, 3, 8));
  REQUIRE(planes.height_at(10.2, 3, 8));
  CHECK(*planes.height_at(10.2, 3, 8) == Approx(0.2));
  CHECK_FALSE(planes.height_at(11.2, 3, 8));
}

TEST_CASE("points in a line make no plane") {
  std::vector<vec3> line;
  for (int i = 0; i < 400; ++i) line.push_back({0.05 * i, 3, 0.1});
  CHECK_FALSE(ground_planes(line).height_at(10, 3, 8));
}

}  // namespace globalmatch::test_ground_offset

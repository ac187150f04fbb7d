#include "baselines/yaw_search.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/core/rigid.hpp"

namespace globalmatch::test_yaw_search {

using namespace benchmarks;
using detail::random_source;

namespace {

constexpr double pi = std::numbers::pi;

bool is_in(const angle_interval& i, double angle) {
  const double after = wrapped_angle(angle - i.begin);
  return (after < 0 ? after + 2 * pi : after) <= i.length;
}

std::size_t count_at(const std::vector<angle_interval>& intervals, double angle) {
  return std::size_t(std::count_if(intervals.begin(), intervals.end(),
                                   [&](const angle_interval& i) { return is_in(i, angle); }));
}

}  // namespace

TEST_CASE("the angles at which a point is near another are those that turning it finds") {
  random_source random(1);
  std::size_t always = 0, never = 0, sometimes = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const vec3 p{random.normal(), random.normal(), random.normal()};
    const vec3 q{random.normal(), random.normal(), random.normal()};
    const double radius = 3 * random.uniform();
    const auto angles = angles_within(p, q, radius);
    ++(!angles ? never : angles->length >= 2 * pi ? always : sometimes);
    for (double angle = -pi; angle < pi; angle += 0.05) {
      const double distance = (detail::rotation_about_z(angle) * p - q).norm();
      if (std::abs(distance - radius) < 1e-9) continue;
      CHECK((angles && is_in(*angles, angle)) == (distance < radius));
    }
  }
  CHECK(always > 20);
  CHECK(never > 20);
  CHECK(sometimes > 100);
}

TEST_CASE("points on the axis are near at all angles or at none") {
  const auto near = angles_within({0, 0, 1}, {0.1, 0, 1}, 0.2);
  REQUIRE(near);
  CHECK(near->length >= 2 * pi);
  CHECK_FALSE(angles_within({0, 0, 1}, {0.1, 0, 2}, 0.2));
}

TEST_CASE("no angle is in more intervals than the one that is found") {
  random_source random(2);
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<angle_interval> intervals;
    const std::size_t count = 1 + random.below(12);
    for (std::size_t i = 0; i < count; ++i)
      intervals.push_back({2 * pi * random.uniform() - pi, (i % 4 ? 1.0 : 6.0) * random.uniform()});
    if (trial % 5 == 0) intervals.push_back({-pi, 2 * pi});
    const best_angle best = stab_most(intervals);
    CHECK(count_at(intervals, best.angle) == best.count);
    std::size_t most = 0;  // some largest set has the begin of an interval in common
    for (const angle_interval& i : intervals) most = std::max(most, count_at(intervals, i.begin));
    CHECK(best.count == most);
  }
}

TEST_CASE("of no intervals none has an angle") {
  CHECK(stab_most({}).count == 0);
  CHECK(stab_most({{-pi, 2 * pi}, {-pi, 2 * pi}}).count == 2);
}

}  // namespace globalmatch::test_yaw_search

#include "globalmatch/detail/core/coordinate_steps.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_coordinate_steps {

using namespace detail;

namespace {

using scenes::uniform;

std::vector<vec3> places(std::size_t count, random_source& random) {
  std::vector<vec3> result;
  for (std::size_t i = 0; i < count; ++i)
    result.push_back({uniform(random, -30, 25), uniform(random, -10, 40), uniform(random, 0, 5)});
  return result;
}

double rounded(double value, double step) {
  return step * std::round(value / step);
}

}  // namespace

TEST_CASE("places in steps are told apart by squares of the step, wherever they begin") {
  for (const double step : {0.01, 0.05, 0.1, 0.25, 0.3048, 0.5, 1.0, 2.0})
    for (const double begin : {0.0, 412345.678}) {
      random_source random(1);
      std::vector<vec3> noted = places(40, random);
      for (vec3& p : noted) p = {begin + rounded(p.x, step), rounded(p.y, step) - begin, p.z};
      CHECK(cell_area(noted) == Approx(step * step));
    }
}

TEST_CASE("one place in ten may be off the steps, more may not") {
  random_source random(2);
  std::vector<vec3> noted = places(50, random);
  for (std::size_t i = 5; i < noted.size(); ++i)
    noted[i] = {rounded(noted[i].x, 0.5), rounded(noted[i].y, 0.5), noted[i].z};
  CHECK(cell_area(noted) == 0.25);
  for (std::size_t i = 5; i < 9; ++i) noted[i].x += 0.1234567;
  CHECK(cell_area(noted) == 0);
}

TEST_CASE("measured places are not in steps, and a few places do not show any") {
  for (const std::size_t count : {8u, 60u, 3000u}) {
    random_source random(3 + count);
    CHECK(cell_area(places(count, random)) == 0);
  }
  const std::vector<vec3> few = {{0, 0, 0}, {1, 2, 0}, {5, 3, 0}, {7, 7, 0}, {2, 8, 0}, {1, 4, 0}, {9, 1, 0}};
  CHECK(few.size() == 7);
  CHECK(cell_area(few) == 0);
}

TEST_CASE("the finer of two steps counts") {
  random_source random(4);
  std::vector<vec3> noted = places(40, random);
  for (vec3& p : noted) p = {rounded(p.x, 1), rounded(p.y, 0.1), p.z};
  CHECK(cell_area(noted) == Approx(0.01));
}

TEST_CASE("places by compass and tape are told apart by sectors of rings around the origin") {
  for (const double degrees : {1.0, 5.0})
    for (const double step : {0.2, 0.5}) {
      random_source random(5);
      const double angle = degrees * std::numbers::pi / 180;
      std::vector<vec3> noted;
      double area = 0;
      for (const vec3& p : places(60, random)) {
        const double direction = rounded(std::atan2(p.y, p.x), angle),
                     distance = rounded(p.xy().norm(), step);
        noted.push_back({rounded(distance * std::cos(direction), 0.01),
                         rounded(distance * std::sin(direction), 0.01), 0});
        area += angle * step * distance / 60;
      }
      CHECK(cell_area(noted) == Approx(area).epsilon(0.01));
    }
}

TEST_CASE("a distance in steps without a direction in steps is none") {
  random_source random(6);
  std::vector<vec3> noted;
  for (const vec3& p : places(60, random)) {
    const double direction = std::atan2(p.y, p.x), distance = rounded(p.xy().norm(), 0.5);
    noted.push_back({distance * std::cos(direction), distance * std::sin(direction), 0});
  }
  CHECK(cell_area(noted) == 0);
}

}  // namespace globalmatch::test_coordinate_steps

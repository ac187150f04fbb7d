#include "globalmatch/detail/core/position_index.hpp"

#include <algorithm>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_position_index {

using namespace detail;

using scenes::positions;

namespace {

double horizontal_squared(const position_set& stems, std::size_t i, std::size_t j) {
  return (stems.at[i] - stems.at[j]).xy().squared_norm();
}

void require_brute_force(const position_set& stems) {
  const position_index index(stems);
  REQUIRE(index.size() == stems.size());
  std::vector<neighbor<double>> found;
  for (std::size_t i = 0; i < stems.size(); ++i) {
    std::vector<neighbor<double>> expected;
    for (std::uint32_t j = 0; j < stems.size(); ++j)
      if (j != i) expected.push_back({j, horizontal_squared(stems, i, j)});
    std::sort(expected.begin(), expected.end());
    for (const std::size_t k : {1u, 5u, 1000u}) {
      index.nearest(i, k, found);
      REQUIRE(found.size() == std::min<std::size_t>(k, stems.size() - 1));
      for (std::size_t n = 0; n < found.size(); ++n) {
        CHECK(found[n].index == expected[n].index);
        CHECK(found[n].squared_distance == expected[n].squared_distance);
      }
    }
    std::vector<stem_index> within;
    index.for_each_within(stems.at[i].x, stems.at[i].y, 4, [&](stem_index j, double squared) {
      CHECK(squared == Approx(horizontal_squared(stems, i, j)).margin(1e-12));
      within.push_back(j);
    });
    std::size_t expected_within = 1;  // itself
    for (const auto& n : expected) expected_within += n.squared_distance < 16;
    CHECK(within.size() == expected_within);
    for (const double radius : {0.5, 2.0, 8.0}) {
      const vec3 place = stems.at[i] + vec3{1, 1, 0};
      bool any = false;
      for (const vec3& p : stems.at) any = any || (p - place).xy().squared_norm() < radius * radius;
      CHECK(index.any_within(place.x, place.y, radius) == any);
    }
  }
}

}  // namespace

TEST_CASE("horizontal neighbours equal those of brute force, on maps of any kind") {
  random_source random(1);
  require_brute_force(scenes::set_in_order(scenes::random_stems(random, 120, 40, 40)));
  require_brute_force(scenes::set_in_order(scenes::random_stems(random, 60, 500, 2)));
  require_brute_force(scenes::set_in_order(scenes::lattice(8, 8, 3)));
  require_brute_force(scenes::set_in_order(positions(10, Eigen::Vector3d(1, 2, 3))));
  require_brute_force(scenes::set_in_order(scenes::random_stems(random, 2, 10, 10)));
}

TEST_CASE("outliers a million kilometres away do not change the spacing, and are found") {
  random_source random(2);
  positions stems = scenes::random_stems(random, 100, 30, 30);
  const double spacing = position_index(scenes::set_in_order(stems)).spacing();
  CHECK(spacing == Approx(3).epsilon(0.3));
  stems.push_back({1e9, 1e9, 0});
  stems.push_back({-1e9, 5, 0});
  CHECK(position_index(scenes::set_in_order(stems)).spacing() == Approx(spacing).epsilon(0.1));
  require_brute_force(scenes::set_in_order(stems));
}

TEST_CASE("maps of no stem and of one have no neighbours") {
  CHECK(position_index(position_set{}).size() == 0);
  const position_index one(scenes::set_in_order({{1, 2, 3}}));
  std::vector<neighbor<double>> found = {{7, 1.0}};
  one.nearest(0, 3, found);
  CHECK(found.empty());
}

TEST_CASE("the middle extent is that of the stems without the outer tenths, along each axis") {
  positions line;
  for (int i = 0; i < 20; ++i) line.push_back({2.0 * i - 100, 5.0 * ((7 * i) % 20) + 3, 11.0 * i});
  const position_set stems = scenes::set_in_order(line);
  CHECK(middle_extent(stems, 0) == 2 * (17 - 2));
  CHECK(middle_extent(stems, 1) == 5 * (17 - 2));
}

TEST_CASE("the spacing is that of a square grid of equal density, whatever the shape of the map") {
  positions stems;
  for (int i = 0; i < 90; ++i)
    for (int j = 0; j < 30; ++j) stems.push_back({3.0 * i - 40, 0.8 * j + 900, 0.2 * i});
  CHECK(position_index(scenes::set_in_order(stems)).spacing() == Approx(std::sqrt(3 * 0.8)).epsilon(0.05));
}

}  // namespace globalmatch::test_position_index

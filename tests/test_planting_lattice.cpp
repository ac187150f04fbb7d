#include "globalmatch/detail/matching/planting_lattice.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_planting_lattice {

using namespace detail;

using scenes::positions;

namespace {

constexpr double degree = std::numbers::pi / 180;

/// `columns` by `rows` stems, the shifts between them as given [m], turned by `yaw`.
positions planted(int columns, int rows, const Eigen::Vector2d& first, const Eigen::Vector2d& second,
                  double yaw) {
  const Eigen::Rotation2Dd turn(yaw);
  positions stems;
  for (int c = 0; c < columns; ++c)
    for (int r = 0; r < rows; ++r) {
      const Eigen::Vector2d p = turn * Eigen::Vector2d(c * first + r * second);
      stems.push_back({p.x(), p.y(), 0});
    }
  return stems;
}

position_index index_of(const positions& stems) {
  return position_index(scenes::set_in_order(stems));
}

double acute(double angle) {
  return std::min(angle, std::numbers::pi - angle);
}

}  // namespace

TEST_CASE("the lattice is that which was planted, whatever its spacing, direction, jitter and gaps") {
  struct planting {
    Eigen::Vector2d first, second;
  };
  const planting plantings[] = {
      {{3, 0}, {0, 3}}, {{2, 0}, {0, 4}}, {{1.5, 0}, {0, 5}}, {{3, 0}, {1.5, 2.6}}, {{3, 0}, {1.5, 3}}};
  random_source random(1);
  for (const auto& [first, second] : plantings)
    for (int trial = 0; trial < 20; ++trial) {
      CAPTURE(first.transpose(), second.transpose(), trial);
      const double yaw = scenes::uniform(random, -std::numbers::pi, std::numbers::pi);
      positions stems = scenes::noisy(planted(14, 12, first, second, yaw), 0.04 * first.norm(), random);
      std::erase_if(stems, [&](const Eigen::Vector3d&) { return random.uniform() < 0.1; });
      const auto found = find_lattice(index_of(stems));
      REQUIRE(found);
      CHECK(found->first.norm() == Approx(first.norm()).epsilon(0.03));
      CHECK(found->second.norm() == Approx(second.norm()).epsilon(0.03));
      CHECK(found->angle() > 0);
      // Of a lattice of equilateral triangles any of three directions may come first.
      const bool triangles = std::abs(second.norm() - first.norm()) < 0.02;
      const double step =
          triangles ? std::acos(first.dot(second) / first.norm() / second.norm()) : std::numbers::pi;
      CHECK(std::abs(std::remainder(found->direction() - yaw, step)) < 2 * degree);
      // Staggered rows have two such shifts, one to either side.
      CHECK(std::abs(acute(found->angle()) - acute(std::atan2(second.y(), second.x()))) < 3 * degree);
    }
}

TEST_CASE("stems in one row, or fewer than four, have no lattice") {
  CHECK(!find_lattice(index_of({})));
  CHECK(!find_lattice(index_of(scenes::lattice(3, 1, 2))));
  CHECK(!find_lattice(index_of(scenes::lattice(40, 1, 2))));
  CHECK(!find_lattice(index_of(positions(10, Eigen::Vector3d(1, 2, 3)))));
}

TEST_CASE("stems much closer than the spacing have no lattice: shifts to both sides cancel") {
  const positions few = {{0, 0, 0},       {2.56, 0.01, 0}, {5.1, 0, 0},         {5.11, 28.16, 0},
                         {5.12, 2.56, 0}, {7.67, 0.01, 0}, {273.92, 269.86, 0}, {274.97, 310.82, 0}};
  CHECK(!find_lattice(index_of(few)));
  random_source random(3);
  for (int trial = 0; trial < 200; ++trial) {  // any lattice that is found is one to walk along
    positions stems = scenes::random_stems(random, 5, 3, 3);
    for (const Eigen::Vector3d& far : scenes::random_stems(random, 4, 400, 400)) stems.push_back(far);
    const position_index index = index_of(stems);
    const auto found = find_lattice(index);
    if (!found) continue;
    CHECK(std::min(found->first.norm(), found->second.norm()) > 0.15 * index.spacing());
    CHECK(found->search_radius() < found->second.norm());
  }
}

TEST_CASE("a lattice turns onto itself by half turns, squares by quarters, equilateral triangles by sixths") {
  const auto turns = [](const vec2& first, const vec2& second) {
    return lattice_shifts{first, second}.turns().size();
  };
  CHECK(turns({3, 0}, {0, 4}) == 2);
  CHECK(turns({3, 0}, {0, 3}) == 4);
  CHECK(turns({3, 0}, {1.5, 1.5 * std::numbers::sqrt3}) == 6);
  CHECK(turns({3, 1}, {-1, 3}) == 4);
}

TEST_CASE("gaps are the places of missing stems inside, with three neighbours or more") {
  const lattice_shifts rows{{3, 0}, {0, 3}};
  random_source random(2);
  const positions full = scenes::noisy(scenes::lattice(10, 10, 3), 0.1, random);
  CHECK(find_gaps(index_of(full), rows).empty());

  positions stems;  // without (2, 2), with (5, 5) and (5, 6), without a row, without a corner
  for (std::size_t i = 0; i < full.size(); ++i) {
    const std::size_t column = i / 10, row = i % 10;
    const bool missing = (column == 2 && row == 2) || (column == 5 && (row == 5 || row == 6)) ||
                         column == 8 || (column == 0 && row == 0);
    if (!missing) stems.push_back(full[i]);
  }
  auto gaps = find_gaps(index_of(stems), rows);
  REQUIRE(gaps.size() == 3);
  std::sort(gaps.begin(), gaps.end(), [](const auto& a, const auto& b) { return a.y < b.y; });
  CHECK((gaps[0] - vec2{6, 6}).norm() < 0.5);
  CHECK((gaps[1] - vec2{15, 15}).norm() < 0.5);
  CHECK((gaps[2] - vec2{15, 18}).norm() < 0.5);
}

TEST_CASE("a skewed lattice maps to itself by whole steps along both shifts, and by half a turn alone") {
  const lattice_shifts skewed{{2.1, 0.4}, {0.7, 2.9}};
  CHECK(skewed.is_lattice_shift(3 * skewed.first - 2 * skewed.second));
  CHECK_FALSE(skewed.is_lattice_shift(1.5 * skewed.first));
  CHECK_FALSE(skewed.is_lattice_shift(skewed.first + 0.5 * skewed.second));
  CHECK(skewed.turns().size() == 2);
  CHECK(skewed.angle() == Approx(std::atan2(2.9, 0.7) - std::atan2(0.4, 2.1)));
  CHECK(skewed.direction() == Approx(std::atan2(0.4, 2.1)));
  const lattice_shifts square{{1.2, 1.6}, {-1.6, 1.2}};
  CHECK(square.turns().size() == 4);
  const lattice_shifts triangular{{2, 0}, {1, std::sqrt(3.0)}};
  CHECK(triangular.turns().size() == 6);
  const lattice_shifts flat{{3, 0}, {2.4, 0.9}};  // the third side is the shortest
  CHECK(flat.search_radius() == Approx(0.3 * std::hypot(0.6, 0.9)));
}

}  // namespace globalmatch::test_planting_lattice

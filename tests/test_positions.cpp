#include "globalmatch/positions.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "catch.hpp"
#include "position_types.hpp"
#include "stem_scenes.hpp"

namespace surveyors {

/// A type that knows how uncertain it is.
struct surveyed_stem {
  double east, north, height, uncertainty;
};

/// A type that knows how thick it is, as it says, not as its member would.
struct taped_stem {
  double east, north, girth;
  double radius = -1;
};

}  // namespace surveyors

template <>
struct globalmatch::point_traits<surveyors::surveyed_stem> {
  static std::array<double, 3> xyz(const surveyors::surveyed_stem& s) { return {s.east, s.north, s.height}; }
  static double position_sigma(const surveyors::surveyed_stem& s) { return s.uncertainty; }
};

template <>
struct globalmatch::point_traits<surveyors::taped_stem> {
  static constexpr int dimension = 2;
  static std::array<double, 2> xyz(const surveyors::taped_stem& s) { return {s.east, s.north}; }
  static double radius(const surveyors::taped_stem& s) { return s.girth / (2 * std::numbers::pi); }
};

namespace globalmatch::test_positions {

using namespace detail;

using scenes::positions;
using surveyors::surveyed_stem;
using surveyors::taped_stem;

namespace {

const Eigen::Vector3d z_up = Eigen::Vector3d::UnitZ();

struct thick_stem {
  double x, y, z;
  float radius;
};

template <class R>
void require_increasing_and_mapped_back(const R& given, const position_set& set) {
  REQUIRE(set.size() == static_cast<std::size_t>(std::ranges::distance(given)));
  REQUIRE(set.original.size() == set.size());
  positions of_caller;
  for (const auto& p : given) of_caller.push_back(to_eigen(xyz(p)));
  std::vector<bool> seen(set.size());
  for (std::size_t i = 0; i < set.size(); ++i) {
    CHECK((to_eigen(set.frame.to_scan(set.at[i])) - of_caller[set.original[i]]).norm() < 1e-12);
    CHECK_FALSE(seen[set.original[i]]);
    seen[set.original[i]] = true;
    if (i == 0) continue;
    const Eigen::Vector3d &before = of_caller[set.original[i - 1]], &p = of_caller[set.original[i]];
    CHECK_FALSE(std::lexicographical_compare(p.begin(), p.end(), before.begin(), before.end()));
  }
}

}  // namespace

TEST_CASE("import_positions sorts stems of any type by position and maps them back") {
  random_source random(1);
  const positions stems = scenes::random_stems(random, 40, 30, 30);
  scenes::for_each_type_with_heights(stems, [](const char* name, const auto& range) {
    INFO(name);
    const position_set set = import_positions(range, z_up, "source");
    CHECK(set.has_heights);
    require_increasing_and_mapped_back(range, set);
  });
  scenes::for_each_type_without_heights(stems, [](const char* name, const auto& range) {
    INFO(name);
    const position_set set = import_positions(range, z_up, "source");
    CHECK_FALSE(set.has_heights);
    require_increasing_and_mapped_back(range, set);
    for (const vec3& p : set.at) CHECK(p.z == 0);
  });
}

TEST_CASE("import_positions gives the same bits whatever the order of the stems") {
  random_source random(2);
  const positions stems = scenes::random_stems(random, 50, 30, 30);
  const position_set set = import_positions(stems, z_up, "source");
  for (int iteration = 0; iteration < 20; ++iteration) {
    const positions shuffled = scenes::reordered(stems, scenes::random_order(stems.size(), random));
    const position_set other = import_positions(shuffled, z_up, "source");
    CHECK(other.at == set.at);
    CHECK(other.frame.origin == set.frame.origin);
  }
}

TEST_CASE("of stems at one place the first one of the caller stays, and the others are counted") {
  const positions stems = {{10, 20, 3}, {0, 0, 0}, {10, 20, 3}, {10, 20, 7}, {0, 30, 0}, {10, 20, 3}};
  const position_set set = import_positions(stems, z_up, "source");
  CHECK(set.original == std::vector<stem_index>{1, 4, 0});
  CHECK(set.coincident == 3);
}

TEST_CASE("stems within a hand of each other are one stem, and trees side by side are not") {
  positions stems = {{0, 0, 0}, {20, 0, 0}, {0, 30, 0}, {20, 30, 0}, {7, 8, 1}, {13, 21, 2}};
  const std::size_t trees = stems.size();
  stems.push_back({7.1, 8.08, 1});    // 13 cm aside
  stems.push_back({13.1, 21.15, 2});  // 18 cm aside
  const position_set set = import_positions(stems, z_up, "source");
  CHECK(set.size() == trees + 1);
  CHECK(set.coincident == 1);
  CHECK(std::count(set.original.begin(), set.original.end(), stem_index(6)) == 0);
}

TEST_CASE("how near stems coincide follows from their spacing, whatever the unit") {
  random_source random(12);
  positions stems = scenes::random_stems(random, 40, 40, 40);
  for (Eigen::Vector3d& p : stems) p *= 1e-5;  // degrees
  CHECK(import_positions(stems, z_up, "source").coincident == 0);
  stems.push_back(stems[7]);
  CHECK(import_positions(stems, z_up, "source").coincident == 1);
}

TEST_CASE("a row without coordinates does not make one stem of a map in degrees") {
  random_source random(14);
  positions stems = scenes::random_stems(random, 100, 40, 40);
  for (Eigen::Vector3d& p : stems) p = {13.4 + 1e-5 * p.x(), 52.5 + 1e-5 * p.y(), p.z()};
  stems.push_back({0, 0, 0});
  CHECK(import_positions(stems, z_up, "source").coincident == 0);
}

TEST_CASE("stems in a line coincide only where they are equal, and many take no time") {
  positions stems;
  for (int i = 0; i < 200000; ++i) stems.push_back({0, 0.5 * (i / 2), 0});
  const position_set set = import_positions(stems, z_up, "source");
  CHECK(set.coincident == 100000);
}

TEST_CASE("points of a scan are refused as stems, by name, and as many stems are not") {
  random_source random(15);
  const auto on_square = [&](double side) {
    positions at = scenes::random_stems(random, 20000, side, side);
    for (Eigen::Vector3d& p : at) p.z() *= 0.01;  // a flat floor
    return at;
  };
  const auto message = [](const positions& at, const Eigen::Vector3d& up) -> std::string {
    try {
      import_positions(at, up, "target");
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  const positions scan = on_square(30), bamboo = on_square(85);
  const std::string refused = message(scan, z_up);
  CHECK(refused.starts_with("target: 1"));
  CHECK(refused.find("on a square metre, are points of a scan") != std::string::npos);
  CHECK(message(bamboo, z_up).empty());
  const auto turned = [](positions at) {  // y up
    for (Eigen::Vector3d& p : at) p = {p.x(), p.z(), -p.y()};
    return at;
  };
  CHECK(message(turned(scan), Eigen::Vector3d::UnitY()).find(" on a square metre") != std::string::npos);
  CHECK(message(turned(bamboo), Eigen::Vector3d::UnitY()).empty());
  CHECK(message(positions(50000, {3, 4, 5}), z_up).empty());  // one stem, listed often
  positions row;
  for (int i = 0; i < 20000; ++i) row.push_back({0.5 * i, 0, 0});
  CHECK(message(row, z_up).empty());
}

TEST_CASE("where up is along y stems above each other do not coincide, and equal ones do") {
  const positions stems = {{0, 1, 0}, {0, 5, 0}, {30, 2, 8}, {30, 2, 8}, {12, 0, 30}, {3, 40, 21}};
  const position_set set = import_positions(stems, Eigen::Vector3d::UnitY(), "source");
  CHECK(set.coincident == 1);
  CHECK(set.size() == 5);
}

TEST_CASE("import_positions knows the steps that coordinates are noted in, levelled") {
  random_source random(13);
  positions stems = scenes::random_stems(random, 40, 40, 40);
  CHECK(import_positions(stems, z_up, "source").cell_area == 0);
  for (Eigen::Vector3d& p : stems) p = {std::round(2 * p.x()) / 2, p.y(), std::round(2 * p.z()) / 2};
  CHECK(import_positions(stems, z_up, "source").cell_area == 0);
  CHECK(import_positions(stems, Eigen::Vector3d::UnitY(), "source").cell_area == Approx(0.25));
}

TEST_CASE("import_positions of no stems is an empty set") {
  const position_set set = import_positions(positions{}, z_up, "source");
  CHECK(set.size() == 0);
  CHECK(set.original.empty());
}

TEST_CASE("import_positions names the map and the position that is not finite") {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    for (const Eigen::Index coordinate : {0, 1, 2}) {
      positions stems = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}};
      stems[1][coordinate] = bad;
      CHECK_THROWS_AS(import_positions(stems, z_up, "target"), std::invalid_argument);
      CHECK_THROWS_WITH(import_positions(stems, z_up, "target"),
                        Catch::Contains("target: position 1 is not"));
    }
}

TEST_CASE("import_positions refuses what a double holds no millimetres of") {
  CHECK(import_positions(positions{{1e12, 0, 0}}, z_up, "source").size() == 1);
  for (const double far : {1.1e12, -1e155, 1e307})
    CHECK_THROWS_WITH(import_positions(positions{{0, 0, 0}, {0, far, 0}}, z_up, "source"),
                      Catch::Contains("source: position 1 is more than 1e12 m"));
}

TEST_CASE("import_positions keeps what a type knows of its uncertainty, in the order of the stems") {
  const std::vector<surveyed_stem> stems = {{3, 0, 0, 0.3}, {1, 0, 0, 0.1}, {2, 0, 0, 0}};
  const auto sigma = import_positions(stems, z_up, "source").sigma;
  REQUIRE(sigma.size() == 3);
  CHECK(sigma[0] == 0.1);
  CHECK(sigma[1] == Approx(0.2));  // unknown: the median of what is known
  CHECK(sigma[2] == 0.3);
  CHECK(import_positions(std::vector<surveyed_stem>{{1, 0, 0, 0}}, z_up, "source").sigma.empty());
  CHECK(import_positions(positions{{1, 2, 3}}, z_up, "source").sigma.empty());
}

TEST_CASE("import_positions gives the same bits when stems at one place differ in their uncertainty alone") {
  const std::vector<surveyed_stem> stems = {{1, 0, 0, 0.3}, {1, 0, 0, 0.1}, {9, 9, 0, 0.2}},
                                   swapped = {stems[1], stems[2], stems[0]};
  CHECK(import_positions(stems, z_up, "source").sigma == std::vector<double>{0.1, 0.2});
  CHECK(import_positions(stems, z_up, "source").sigma == import_positions(swapped, z_up, "source").sigma);
}

TEST_CASE("import_positions names the map and the uncertainty that makes no sense") {
  for (const double wrong :
       {-0.1, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    const std::vector<surveyed_stem> stems = {{3, 0, 0, 0.3}, {1, 0, 0, wrong}};
    CHECK_THROWS_WITH(import_positions(stems, z_up, "target"),
                      "target: position_sigma 1 is negative or not finite; 0 stands for unknown");
  }
}

TEST_CASE("import_positions keeps what a type knows of radii, in the order of the stems") {
  const std::vector<thick_stem> thick = {{3, 0, 0, 0.25f}, {1, 0, 0, 0.5f}, {2, 0, 0, 0.125f}};
  CHECK(import_positions(thick, z_up, "source").radius == std::vector<double>{0.5, 0.125, 0.25});
  const std::vector<taped_stem> taped = {{3, 0, std::numbers::pi}, {1, 0, 2 * std::numbers::pi}};
  const position_set set = import_positions(taped, z_up, "source");
  CHECK(set.radius == std::vector<double>{1, 0.5});
  CHECK_FALSE(set.has_heights);
}

TEST_CASE("a radius that is no length is unknown, and where all are the set has none") {
  constexpr float infinity = std::numeric_limits<float>::infinity(),
                  nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<thick_stem> stems = {
      {0, 0, 0, nan}, {1, 0, 0, infinity}, {2, 0, 0, -infinity}, {3, 0, 0, -0.5f}, {4, 0, 0, 0}};
  CHECK(import_positions(stems, z_up, "source").radius.empty());
  stems.push_back({5, 0, 0, 0.5f});
  CHECK(import_positions(stems, z_up, "source").radius == std::vector<double>{0, 0, 0, 0, 0, 0.5});
  CHECK(import_positions(positions{{1, 2, 3}}, z_up, "source").radius.empty());
  CHECK(import_positions(std::vector<thick_stem>{}, z_up, "source").radius.empty());
}

TEST_CASE("import_positions gives the same bits when stems at one place differ in their radius alone") {
  const std::vector<thick_stem> stems = {{1, 0, 0, 0.5f}, {1, 0, 0, 0.25f}, {1, 0, 0, NAN}},
                                swapped = {stems[2], stems[1], stems[0]};
  CHECK(import_positions(stems, z_up, "source").radius == std::vector<double>{0.25});
  CHECK(import_positions(swapped, z_up, "source").radius == std::vector<double>{0.25});
}

TEST_CASE("import_positions refuses an up without direction") {
  const positions stems = {{0, 0, 0}};
  for (const Eigen::Vector3d& up : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0, 0, NAN)})
    CHECK_THROWS_WITH(import_positions(stems, up, "source"), Catch::Contains("up must be"));
}

TEST_CASE("import_positions makes height along any up the z of its frame and keeps distances") {
  random_source random(3);
  const positions stems = scenes::random_stems(random, 20, 30, 30);
  for (const Eigen::Vector3d& up : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, -3, 0),
                                    Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(0.1, 0.2, 0.9)}) {
    const position_set set = import_positions(stems, up, "source");
    for (std::size_t i = 1; i < set.size(); ++i) {
      const Eigen::Vector3d given = stems[set.original[i]] - stems[set.original[0]];
      const vec3 local = set.at[i] - set.at[0];
      CHECK(local.z == Approx(given.dot(up.normalized())).margin(1e-12));
      CHECK(local.norm() == Approx(given.norm()));
    }
  }
}

TEST_CASE("horizontal positions have no heights whatever the up") {
  const std::vector<Eigen::Vector2d> stems = {{0, 0}, {5, 1}, {2, 7}};
  const position_set set = import_positions(stems, Eigen::Vector3d(0.1, 0.2, 0.9), "source");
  for (std::size_t i = 0; i < set.size(); ++i) {
    CHECK(set.at[i].z == 0);
    CHECK((set.at[i] - set.at[0]).norm() ==
          Approx((stems[set.original[i]] - stems[set.original[0]]).norm()).margin(1e-12));
  }
}

TEST_CASE("import_positions keeps tenths of millimetres of coordinates of a million metres") {
  const positions stems = {{1e6, 5e6, 1e3}, {1e6 + 3 + 1e-4, 5e6, 1e3}, {1e6, 5e6 + 7, 1e3 - 1e-4}};
  const position_set set = import_positions(stems, z_up, "source");
  CHECK(set.at[0].norm() == 0);
  CHECK(set.at[1].y == Approx(7).margin(1e-8));
  CHECK(set.at[1].z == Approx(-1e-4).margin(1e-8));
  CHECK(set.at[2].x == Approx(3 + 1e-4).margin(1e-8).epsilon(0));
}

TEST_CASE("stem_distance leaves heights out where they do not count") {
  CHECK(stem_distance({1, 2, 3}, {4, 6, 15}, false) == 13);
  CHECK(stem_distance({1, 2, 3}, {4, 6, 15}, true) == 5);
}

}  // namespace globalmatch::test_positions

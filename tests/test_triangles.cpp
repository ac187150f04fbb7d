#include "globalmatch/triangles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "catch.hpp"
#include "oracles/brute_force_local_matching.hpp"
#include "oracles/brute_force_triangles.hpp"
#include "position_types.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_triangles {

using namespace detail;

using scenes::positions;
using triplet = std::array<stem_index, 3>;

namespace {

triplet in_order(triplet v) {
  std::sort(v.begin(), v.end());
  return v;
}

std::set<triplet> triplets_of(const std::vector<triangle>& triangles) {
  std::set<triplet> triplets;
  for (const triangle& t : triangles) triplets.insert(in_order(t.vertices));
  return triplets;
}

/// Vertex orders in the caller's indices, so that two imports of one map can be compared.
std::set<triplet> orders_of(const position_set& stems) {
  std::set<triplet> orders;
  for (const triangle& t : build_triangles(stems, false)) {
    const auto& v = t.vertices;
    orders.insert({stems.original[v[0]], stems.original[v[1]], stems.original[v[2]]});
  }
  return orders;
}

std::vector<triangle> orders_within(const triangle& t, double epsilon) {
  std::vector<triangle> orders;
  for (const triangle& order : admissible_orders(t, epsilon)) orders.push_back(order);
  return orders;
}

/// How many of the triangles of one view have the vertices in another order in the other view: by their
/// canonical order alone, and among the admissible orders.
struct lost_triangles {
  std::size_t of = 0, canonical_only = 0, admissible = 0;
};

lost_triangles count_lost(const positions& source, const positions& target, double epsilon) {
  const position_set source_set = scenes::set_in_order(source), target_set = scenes::set_in_order(target);
  lost_triangles lost;
  for (const triangle& t : build_triangles(target_set, false)) {
    const triangle s = make_triangle(source_set, t.vertices, false);
    const auto orders = orders_within(s, epsilon);
    const auto same = [&](const triangle& order) { return order.vertices == t.vertices; };
    ++lost.of;
    lost.canonical_only += !same(s);
    lost.admissible += std::none_of(orders.begin(), orders.end(), same);
  }
  return lost;
}

}  // namespace

TEST_CASE("build_triangles equals brute force, each triangle once") {
  for (const std::uint32_t count : {0u, 1u, 2u, 3u, 4u, 7u, 25u, 60u})
    for (const int neighbors : {2, 3, 6, 20}) {
      INFO(count << " stems, " << neighbors << " neighbors");
      random_source random(count, std::uint64_t(neighbors));
      const position_set stems = scenes::set_in_order(scenes::random_stems(random, count, 30, 30));
      for (const bool horizontal : {false, true}) {
        const auto triangles = build_triangles(stems, horizontal, {.neighbors = neighbors});
        const auto expected = oracles::brute_force_triplets(stems, horizontal, std::size_t(neighbors));
        CHECK(triplets_of(triangles) == expected);
        CHECK(triangles.size() == expected.size());
      }
    }
}

TEST_CASE("build_triangles equals brute force where neighbors are equally far") {
  const position_set stems = scenes::set_in_order(scenes::lattice(7, 6, 2));
  for (const int neighbors : {2, 3, 5, 10, 20}) {
    const auto triangles = build_triangles(stems, false, {.neighbors = neighbors});
    CHECK(triplets_of(triangles) == oracles::brute_force_triplets(stems, false, std::size_t(neighbors)));
  }
}

TEST_CASE("build_triangles of any position type equals brute force") {
  random_source random(4);
  const positions given = scenes::random_stems(random, 30, 30, 30);
  const auto check = [](const char* name, const auto& range) {
    INFO(name);
    const position_set stems = import_positions(range, Eigen::Vector3d::UnitZ(), "source");
    CHECK(triplets_of(build_triangles(stems, !stems.has_heights, {.neighbors = 5})) ==
          oracles::brute_force_triplets(stems, !stems.has_heights, 5));
  };
  scenes::for_each_type_with_heights(given, check);
  scenes::for_each_type_without_heights(given, check);
}

TEST_CASE("build_triangles gives every triangle of maps of up to K + 1 stems, Eq. 2") {
  random_source random(5);
  for (std::size_t n = 0; n <= 21; ++n) {
    const position_set stems = scenes::set_in_order(scenes::random_stems(random, n, 30, 30));
    CHECK(build_triangles(stems, false).size() == (n < 3 ? 0 : n * (n - 1) * (n - 2) / 6));
  }
}

TEST_CASE("K may be as large as it likes: all triangles then") {
  random_source random(4);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 12, 20, 20));
  for (const int neighbors : {11, 12, 100000, std::numeric_limits<int>::max()})
    CHECK(build_triangles(stems, false, {.neighbors = neighbors}).size() == 220);
  CHECK(build_triangles({}, false, {.neighbors = 20}).empty());
}

TEST_CASE("build_triangles gives the same bits for any number of threads, and can be cancelled") {
  random_source random(5);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 200, 50, 50));
  const auto alone = build_triangles(stems, false, {}, {.threads = 1});
  for (const int threads : {2, 8}) {
    const auto together = build_triangles(stems, false, {}, {.threads = threads});
    REQUIRE(together.size() == alone.size());
    for (std::size_t i = 0; i < alone.size(); ++i) {
      CHECK(together[i].vertices == alone[i].vertices);
      CHECK(together[i].edges == alone[i].edges);
    }
  }
  CHECK_THROWS_AS(build_triangles(stems, false, {}, {.on_progress = [](const progress&) { return false; }}),
                  operation_cancelled);
}

TEST_CASE("build_triangles gives at most (K^2 - K) / 2 triangles a stem, Eq. 3") {
  for (const std::uint32_t count : {22u, 50u, 200u})
    for (const std::size_t k : {2u, 5u, 20u}) {
      random_source random(count, k);
      const position_set stems = scenes::set_in_order(scenes::random_stems(random, count, 60, 60));
      const std::size_t triangles = build_triangles(stems, false, {.neighbors = int(k)}).size();
      CHECK(triangles <= (k * k - k) / 2 * count);
      CHECK(triangles >= (k * k - k) / 2 * count / 3);  // no triangle is found from more than its three stems
    }
}

TEST_CASE("triangles of stems in a line, or all at one place, have finite edges") {
  positions line, pile;
  for (int i = 0; i < 30; ++i) {
    line.push_back(i * Eigen::Vector3d(1, 2, 0.1));
    pile.push_back({3, 4, 5});
  }
  for (const positions& stems : {line, pile}) {
    const auto triangles = build_triangles(scenes::set_in_order(stems), false);
    CHECK(triplets_of(triangles).size() == triangles.size());
    CHECK_FALSE(triangles.empty());
    for (const triangle& t : triangles) {
      for (const double edge : t.edges) CHECK(std::isfinite(edge));
      CHECK(t.horizontal_width == Approx(0).margin(1e-9));
    }
  }
}

TEST_CASE(
    "a triangle starts opposite its longest edge and goes counter-clockwise, each edge opposite its vertex") {
  random_source random(6);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 40, 30, 30));
  for (const bool horizontal : {false, true})
    for (const triangle& t : build_triangles(stems, horizontal)) {
      CHECK(t.edges[0] >= std::max(t.edges[1], t.edges[2]));
      CHECK(oracles::signed_parallelogram(stems, t.vertices) >= 0);
      for (std::size_t i = 0; i < 3; ++i) {
        const auto &a = stems.at[t.vertices[(i + 1) % 3]], &b = stems.at[t.vertices[(i + 2) % 3]];
        CHECK(t.edges[i] == stem_distance(a, b, horizontal));
      }
    }
}

TEST_CASE("make_triangle ignores the order it is given the stems in, equal edges included") {
  const position_set stems = scenes::set_in_order({{0, 0, 0}, {4, 0, 0}, {2, 5, 0}, {0, 4, 0}, {2, 0, 0}});
  for (triplet v : {triplet{0, 1, 2}, triplet{0, 1, 3}, triplet{0, 1, 4}}) {
    const triangle expected = make_triangle(stems, v, false);
    do {
      const triangle t = make_triangle(stems, v, false);
      CHECK(t.vertices == expected.vertices);
      CHECK(t.edges == expected.edges);
    } while (std::next_permutation(v.begin(), v.end()));
  }
}

TEST_CASE("triangles keep their vertex order when the map is turned about z, shifted and shuffled") {
  random_source random(7);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const positions stems = scenes::random_stems(random, 25, 30, 30);
  const auto expected = orders_of(import_positions(stems, up, "source"));
  for (int iteration = 0; iteration < 5; ++iteration) {
    const auto order = scenes::random_order(stems.size(), random);
    const positions other =
        scenes::moved(scenes::random_levelled_transform(random), scenes::reordered(stems, order));
    position_set set = import_positions(other, up, "source");
    for (stem_index& i : set.original) i = static_cast<stem_index>(order[i]);
    CHECK(orders_of(set) == expected);
  }
}

TEST_CASE("horizontal triangles do not depend on heights") {
  random_source random(8);
  const positions stems = scenes::random_stems(random, 40, 30, 30);
  positions wrong_heights = stems;
  for (Eigen::Vector3d& p : wrong_heights) p.z() = scenes::uniform(random, -100, 100);
  const auto expected = build_triangles(scenes::set_in_order(stems), true);
  const auto triangles = build_triangles(scenes::set_in_order(wrong_heights), true);
  REQUIRE(triangles.size() == expected.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    CHECK(triangles[i].vertices == expected[i].vertices);
    CHECK(triangles[i].edges == expected[i].edges);
  }
}

TEST_CASE("the horizontal width of a triangle equals area over longest edge") {
  random_source random(9);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 20, 30, 30));
  for (const triangle& t : build_triangles(stems, true)) {
    const double parallelogram = oracles::signed_parallelogram(stems, t.vertices);
    CHECK(t.horizontal_width == Approx(parallelogram / t.edges[0]).margin(1e-6));
  }
}

TEST_CASE("admissible orders equal their definition, the canonical one first and each once") {
  random_source random(10);
  for (const double epsilon : {0.05, 0.5, 5.0}) {
    const position_set stems = scenes::set_in_order(scenes::random_stems(random, 15, 20, 20));
    for (const triangle& t : build_triangles(stems, true)) {
      const auto orders = orders_within(t, epsilon);
      REQUIRE_FALSE(orders.empty());
      CHECK(orders.front().vertices == t.vertices);
      std::set<triplet> found, expected;
      for (const triangle& order : orders) {
        CHECK(found.insert(order.vertices).second);
        for (std::size_t i = 0; i < 3; ++i) {
          const auto &a = stems.at[order.vertices[(i + 1) % 3]], &b = stems.at[order.vertices[(i + 2) % 3]];
          CHECK(order.edges[i] == stem_distance(a, b, true));
        }
      }
      triplet v = in_order(t.vertices);
      do {
        if (oracles::is_admissible(stems, v, true, epsilon)) expected.insert(v);
      } while (std::next_permutation(v.begin(), v.end()));
      CHECK(found == expected);
    }
  }
}

TEST_CASE("a triangle that is far from flat and from isosceles has one admissible order") {
  const position_set stems = scenes::set_in_order({{0, 0, 0}, {5, 0, 0}, {2, 3, 0}});
  CHECK(orders_within(make_triangle(stems, {0, 1, 2}, false), 0.05).size() == 1);
}

TEST_CASE("an equilateral triangle has three admissible orders and a flat one both ways round") {
  const position_set stems =
      scenes::set_in_order({{0, 0, 0}, {4, 0, 0}, {2, std::sqrt(12.0), 0}, {1, 0.04, 0}});
  CHECK(orders_within(make_triangle(stems, {0, 1, 2}, false), 0.05).size() == 3);
  CHECK(orders_within(make_triangle(stems, {0, 1, 3}, false), 0.05).size() == 2);
}

TEST_CASE("in perfect rows the canonical order alone loses congruent triangles, the admissible orders none") {
  constexpr double epsilon = 0.05;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    random_source random(seed);
    const positions rows = scenes::lattice(8, 8, 2.5);
    const lost_triangles lost = count_lost(scenes::jittered(rows, epsilon / 4, random),
                                           scenes::jittered(rows, epsilon / 4, random), epsilon);
    INFO("seed " << seed << ": of " << lost.of << " triangles " << lost.canonical_only);
    CHECK(lost.canonical_only > lost.of / 20);
    CHECK(lost.admissible == 0);
  }
}

TEST_CASE("in random maps the admissible orders lose no congruent triangle either") {
  constexpr double epsilon = 0.05;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    random_source random(seed);
    const positions stems = scenes::random_stems(random, 60, 30, 30);
    const lost_triangles lost = count_lost(scenes::jittered(stems, epsilon / 4, random),
                                           scenes::jittered(stems, epsilon / 4, random), epsilon);
    CHECK(lost.admissible == 0);
  }
}

TEST_CASE("in perfect rows over humps and hollows the admissible orders lose no congruent triangle") {
  constexpr double epsilon = 0.05;
  random_source random(11);
  positions rows = scenes::lattice(8, 8, 2.5);
  for (Eigen::Vector3d& p : rows) p.z() = std::sin(p.x() * 0.8) + std::cos(p.y() * 0.7);
  const lost_triangles lost = count_lost(scenes::jittered(rows, epsilon / 4, random),
                                         scenes::jittered(rows, epsilon / 4, random), epsilon);
  INFO("of " << lost.of << " triangles");
  CHECK(lost.admissible == 0);
}

TEST_CASE("triangle options that make no sense are named") {
  CHECK(triangle_options{}.neighbors == 20);
  CHECK_NOTHROW(require_valid(triangle_options{.neighbors = 2}));
  CHECK_THROWS_AS(require_valid(triangle_options{.neighbors = 1}), std::invalid_argument);
  CHECK_THROWS_WITH(build_triangles({}, false, {.neighbors = -3}), Catch::Contains("triangles.neighbors"));
}

TEST_CASE("the horizontal width is over the edge that is longest horizontally, not in space") {
  const position_set stems = scenes::set_in_order({{0, 0, 0}, {1, 0, 10}, {5, 3, 0}});
  const triangle t = make_triangle(stems, {0, 1, 2}, false);
  CHECK(t.vertices[0] == 0);  // the longest edge in space leads from 1 to 2
  CHECK(t.horizontal_width == Approx(3 / std::hypot(5, 3)));
}

}  // namespace globalmatch::test_triangles

#include "globalmatch/detail/matching/triangle_index.hpp"

#include <algorithm>
#include <set>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_triangle_index {

using namespace detail;

using scenes::positions;

namespace {

using triplet = std::array<stem_index, 3>;

triplet sorted(triplet v) {
  std::sort(v.begin(), v.end());
  return v;
}

triangle_index index_of(const position_set& stems, std::size_t neighbors, const execution& exec = {}) {
  return triangle_index(stems, position_index(stems), false, neighbors, exec);
}

/// All triangles of a map by looking up each in the index of the whole.
std::multiset<triplet> found_like(const triangle_index& index, const triangle& t, double epsilon) {
  std::multiset<triplet> found;
  index.for_each_like(t, epsilon, [&](const triplet& v) { found.insert(v); });
  return found;
}

}  // namespace

TEST_CASE("the index holds the triangles of each stem with two of its nearest, each once") {
  random_source random(1);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 150, 40, 40));
  for (const std::size_t neighbors : {2u, 5u, 9u}) {
    const auto nearest = nearest_stems(position_index(stems), neighbors);
    std::set<triplet> expected;
    for (stem_index i = 0; i < stems.size(); ++i)
      for (std::size_t j = 0; j < neighbors; ++j)
        for (std::size_t k = j + 1; k < neighbors; ++k)
          expected.insert(sorted({i, nearest[i * neighbors + j], nearest[i * neighbors + k]}));
    const triangle_index index = index_of(stems, neighbors);
    REQUIRE(index.size() == expected.size());
    for (const triplet& v : expected) {
      const triangle t = make_triangle(stems, v, false);
      CHECK(found_like(index, t, 1e-3).count(t.vertices) == 1);
    }
  }
}

TEST_CASE("an index of every so many stems holds the triangles that these make, each once") {
  random_source random(5);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 150, 40, 40));
  constexpr std::size_t neighbors = 5;
  const auto nearest = nearest_stems(position_index(stems), neighbors);
  for (const std::size_t step : {1u, 4u, 149u, 1000u}) {
    std::set<triplet> expected;
    for (stem_index i = 0; i < stems.size(); i += stem_index(step))
      for (std::size_t j = 0; j < neighbors; ++j)
        for (std::size_t k = j + 1; k < neighbors; ++k)
          expected.insert(sorted({i, nearest[i * neighbors + j], nearest[i * neighbors + k]}));
    const triangle_index index(stems, position_index(stems), false, neighbors, {}, step);
    CHECK(index.size() == expected.size());
    for (const triplet& v : expected) {
      const triangle t = make_triangle(stems, v, false);
      CHECK(found_like(index, t, 1e-3).count(t.vertices) == 1);
    }
  }
}

TEST_CASE("the index finds all triangles whose edges are alike, as brute force does") {
  random_source random(2);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 80, 25, 25));
  const triangle_index index = index_of(stems, 8);
  std::vector<triangle> all;
  const triangle any{{0, 1, 2}, {0, 0, 0}};
  index.for_each_like(any, 1e6, [&](const triplet& v) { all.push_back(make_triangle(stems, v, false)); });
  REQUIRE(all.size() == index.size());
  for (const double epsilon : {0.05, 0.5, 3.0})
    for (int query = 0; query < 40; ++query) {
      const triangle& t = all[random.below(static_cast<std::uint32_t>(all.size()))];
      std::multiset<triplet> expected;
      for (const triangle& other : all) {
        bool alike = true;
        for (std::size_t i = 0; i < 3; ++i)
          alike = alike && std::abs(float(t.edges[i]) - float(other.edges[i])) <= float(epsilon);
        if (alike) expected.insert(other.vertices);
      }
      CHECK(found_like(index, t, epsilon) == expected);
    }
}

TEST_CASE("small maps give all their triangles") {
  random_source random(3);
  for (const std::size_t count : {0u, 1u, 2u, 3u, 10u}) {
    const position_set stems = scenes::set_in_order(scenes::random_stems(random, count, 15, 15));
    CHECK(index_of(stems, 20).size() == (count < 3 ? 0 : count * (count - 1) * (count - 2) / 6));
  }
}

TEST_CASE("the index is the same for any number of threads") {
  random_source random(4);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 3000, 180, 180));
  const auto in_order = [&](int threads) {
    std::vector<triplet> order;
    index_of(stems, 5, {.threads = threads})
        .for_each_like({{0, 1, 2}, {5, 4, 3}}, 1.0, [&](const triplet& v) { order.push_back(v); });
    return order;
  };
  const auto expected = in_order(1);
  CHECK(expected.size() > 100);
  CHECK(in_order(2) == expected);
  CHECK(in_order(8) == expected);
}

}  // namespace globalmatch::test_triangle_index

#include "globalmatch/detail/matching/prepared_stems.hpp"

#include <cstddef>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_prepared_stems {

using namespace detail;

namespace {

/// The same, made of its parts.
std::size_t triangles_of(const position_set& stems, bool horizontal, std::size_t neighbors) {
  return triangle_index(stems, position_index(stems), horizontal, neighbors).size();
}

}  // namespace

TEST_CASE("in space small maps make triangles with twenty neighbours, others with five") {
  random_source random(1);
  for (const std::size_t count : {30u, 100u, 101u, 400u})
    for (const bool horizontal : {true, false}) {
      CAPTURE(count, horizontal);
      const position_set stems = scenes::set_in_order(scenes::random_stems(random, count, 40, 25));
      const prepared_stems map = prepare_stems(stems, horizontal, {});
      CHECK(map.stems.at == stems.at);
      CHECK(map.horizontal_distances == horizontal);
      CHECK(map.triangles.size() == triangles_of(stems, horizontal, !horizontal && count <= 100 ? 20 : 5));
      REQUIRE(map.index);
      CHECK(map.index->size() == count);
      CHECK(map.index->at(7) == stems.at[7].xy());
      const background_density background(stems, map.index);
      for (const double threshold : {0.05, 0.4})
        CHECK(map.background->inlier_probability(threshold) == background.inlier_probability(threshold));
    }
}

TEST_CASE("edges of the triangles are horizontal or in space, as asked for") {
  const position_set stems = scenes::set_in_order({{0, 0, 0}, {4, 0, 3}, {0, 6, 0}});
  const auto finds = [&](bool horizontal, double edge) {
    const triangle asked =
        make_triangle(scenes::set_in_order({{0, 0, 0}, {edge, 0, 0}, {0, 6, 0}}), {0, 1, 2}, true);
    std::size_t found = 0;
    prepare_stems(stems, horizontal, {}).triangles.for_each_like(asked, 0.01, [&](const auto&) { ++found; });
    return found;
  };
  CHECK(finds(true, 4) == 1);
  CHECK(finds(false, 4) == 0);
}

TEST_CASE("of maps that are matched by large ones only some stems make triangles") {
  random_source random(2);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 40000, 600, 500));
  const std::size_t all = prepare_stems(stems, true, {}).triangles.size();
  CHECK(prepare_stems(stems, true, {}, 39'999).triangles.size() == all);
  const std::size_t some = prepare_stems(stems, true, {}, 40'000).triangles.size();
  CHECK(double(some) < 0.75 * double(all));
  CHECK(double(some) > 0.4 * double(all));
  CHECK(prepare_stems(stems, true, {}, 1'000'000).triangles.size() == some);  // no map asks more than it has
}

TEST_CASE("a map without triangles has all else, and maps of few stems can be prepared") {
  random_source random(3);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 50, 20, 30));
  const prepared_stems map = without_triangles(stems, false, {});
  CHECK(map.triangles.size() == 0);
  CHECK(map.index->size() == 50);
  CHECK(map.background->inlier_probability(0.1) > 0);
  for (const std::size_t count : {0u, 1u, 2u, 3u}) {
    const prepared_stems few =
        prepare_stems(scenes::set_in_order(scenes::random_stems(random, count, 9, 5)), true, {});
    CHECK(few.stems.size() == count);
    CHECK(few.triangles.size() == (count == 3 ? 1u : 0u));
  }
}

}  // namespace globalmatch::test_prepared_stems

#include "globalmatch/detail/survey/overlap_index.hpp"

#include <map>
#include <set>

#include "catch.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_overlap_index {

using namespace detail;

using scenes::positions;

namespace {

constexpr double tolerance = 0.03;

prepared_stems prepare(const positions& stems) {
  return without_triangles(scenes::set_in_order(stems), true, {});
}

}  // namespace

TEST_CASE("triangles of a map are those of each stem with two of its nearest, each once") {
  random_source random(1);
  const prepared_stems map = prepare(scenes::random_stems(random, 60, 20, 20));
  std::set<std::set<stem_index>> expected, found;
  const auto& at = map.stems.at;
  for (stem_index i = 0; i < at.size(); ++i) {
    std::vector<std::pair<double, stem_index>> nearest;
    for (stem_index k = 0; k < at.size(); ++k)
      if (k != i) nearest.push_back({(at[i] - at[k]).xy().norm(), k});
    std::sort(nearest.begin(), nearest.end());
    for (std::size_t j = 0; j < 6; ++j)
      for (std::size_t k = 0; k < j; ++k) expected.insert({i, nearest[j].second, nearest[k].second});
  }
  for (const triangle& t : local_triangles(map, 6))
    CHECK(found.insert({t.vertices.begin(), t.vertices.end()}).second);
  CHECK(found == expected);
  CHECK(local_triangles(prepare({}), 6).empty());
  CHECK(local_triangles(prepare({{1, 2, 3}, {2, 3, 4}}), 6).empty());
}

TEST_CASE("maps that overlap are candidates of each other, with pairs of stems of one tree") {
  random_source random(2);
  const scenes::surveyed_grid s(3, 0.005, random);
  const overlap_index index(s.maps, 2 * tolerance, {});
  for (const bool all_others : {false, true})
    for (std::size_t m = 0; m < 9; ++m) {
      std::map<std::uint32_t, overlap_candidate> best;
      std::uint32_t votes = ~std::uint32_t(0);
      for (const overlap_candidate& c : index.candidates_of(m, tolerance, 1000, all_others)) {
        CHECK(c.source == m);
        CHECK(c.target != m);
        if (!all_others) CHECK(c.target > m);
        CHECK(c.votes >= 2);
        CHECK(c.votes <= votes);
        votes = c.votes;
        best.emplace(c.target, c);
      }
      for (std::size_t other = 0; other < 9; ++other) {
        if (other == m || (!all_others && other < m)) continue;
        if ((s.truth[m].shift - s.truth[other].shift).norm() > 25) continue;
        REQUIRE(best.count(std::uint32_t(other)));
        std::size_t right = 0;
        const auto& pairs = best[std::uint32_t(other)].pairs;
        for (const correspondence& p : pairs)
          right += s.seen.trees[m][p.source] == s.seen.trees[other][p.target];
        CHECK(2 * right > pairs.size());
      }
    }
}

TEST_CASE("candidates are the best ones, the same for any number of threads") {
  random_source random(3);
  const scenes::surveyed_grid s(3, 0.02, random);
  const overlap_index one(s.maps, 2 * tolerance, {.threads = 1}), four(s.maps, 2 * tolerance, {.threads = 4});
  for (std::size_t m = 0; m < 9; ++m) {
    const auto all = one.candidates_of(m, tolerance, 1000, true),
               few = one.candidates_of(m, tolerance, 3, true),
               same = four.candidates_of(m, tolerance, 1000, true);
    CHECK(few.size() == std::min<std::size_t>(3, all.size()));
    REQUIRE(same.size() == all.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      CHECK(same[i].target == all[i].target);
      CHECK(same[i].votes == all[i].votes);
      CHECK(same[i].pairs == all[i].pairs);
      if (i < few.size()) CHECK(few[i].target == all[i].target);
    }
  }
}

TEST_CASE("an index that maps were added to has the candidates of one over all maps") {
  random_source random(5);
  const scenes::surveyed_grid s(3, 0.02, random);
  const overlap_index all(s.maps, 2 * tolerance, {});
  const std::span<const prepared_stems> maps = s.maps;
  for (const std::size_t first : {0u, 5u}) {
    overlap_index index(maps.first(first), 2 * tolerance, {});
    for (std::size_t m = first; m < maps.size(); ++m) {
      if (m > 0) index.set_further(maps.first(m));  // the next one takes the place of one that is not kept
      index.set_further(maps.first(m + 1));
      if (m > first) CHECK(index.candidates_of(m, tolerance, 10, true).size() > 0);
      index.keep_further();
    }
    for (std::size_t m = 0; m < maps.size(); ++m) {
      const auto expected = all.candidates_of(m, tolerance, 1000, m % 2 == 0),
                 found = index.candidates_of(m, tolerance, 1000, m % 2 == 0);
      REQUIRE(found.size() == expected.size());
      for (std::size_t i = 0; i < found.size(); ++i) {
        CHECK(found[i].target == expected[i].target);
        CHECK(found[i].votes == expected[i].votes);
        CHECK(found[i].pairs == expected[i].pairs);
      }
    }
  }
}

TEST_CASE("maps without triangles have no candidates") {
  const std::vector<prepared_stems> none;
  const overlap_index empty(none, 2 * tolerance, {});
  random_source random(4);
  std::vector<prepared_stems> maps;
  for (const std::size_t count : {0u, 1u, 2u, 30u, 30u})
    maps.push_back(prepare(scenes::random_stems(random, count, 20, 20)));
  const overlap_index index(maps, 2 * tolerance, {});
  for (const std::size_t m : {0u, 1u, 2u}) CHECK(index.candidates_of(m, tolerance, 10, true).empty());
}

}  // namespace globalmatch::test_overlap_index

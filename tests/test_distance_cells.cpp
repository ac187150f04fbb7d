#include "globalmatch/detail/core/distance_cells.hpp"

#include <cmath>
#include <set>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_distance_cells {

using namespace detail;

namespace {

void require_all_found(const scenes::positions& positions, bool horizontal, double epsilon,
                       random_source& random) {
  const position_set stems = scenes::set_in_order(positions);
  const distance_cells cells(stems, horizontal, epsilon);
  REQUIRE(cells.size() == stems.size());
  for (stem_index i = 0; i < stems.size(); ++i)
    for (stem_index other = 0; other < stems.size(); ++other) {
      // Also distances that differ by just the tolerance from one in the map.
      const double own = stem_distance(stems.at[i], stems.at[other], horizontal);
      for (const double distance : {own, own + epsilon, std::abs(own - epsilon),
                                    std::nextafter(own + epsilon, 0), scenes::uniform(random, 0, 3 * own)}) {
        std::multiset<stem_index> found, expected;
        cells.for_each_at(i, distance, [&](stem_index j) { found.insert(j); });
        for (stem_index j = 0; j < stems.size(); ++j)
          if (std::abs(distance - stem_distance(stems.at[i], stems.at[j], horizontal)) < epsilon)
            expected.insert(j);
        REQUIRE(found == expected);
        REQUIRE(std::size_t(cells.counts(i)[cells.cell(distance)]) >= found.size());
      }
    }
}

}  // namespace

TEST_CASE("distance cells show the stems at a distance, each once") {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    const auto stems = scenes::random_stems(random, 1 + random.below(20), 20, 20);
    for (const double epsilon : {0.05, 1.0, 100.0, 1e-9})
      require_all_found(stems, seed % 2 == 0, epsilon, random);
  }
}

TEST_CASE("distance cells bear stems far away, at one place, on a lattice, and none") {
  random_source random(1);
  require_all_found({{0, 0, 0}, {1e9, 0, 0}, {1e9, 1, 0}, {0, 3, 0}, {2e4, 0, 1e7}}, false, 0.05, random);
  require_all_found({{1, 2, 3}, {1, 2, 3}, {1, 2, 3}}, false, 0.05, random);
  require_all_found(scenes::lattice(5, 5, 2), false, 2.0, random);
  const position_set none;
  CHECK(distance_cells(none, false, 0.05).size() == 0);
}

}  // namespace globalmatch::test_distance_cells

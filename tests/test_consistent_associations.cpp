#include "baselines/consistent_associations.hpp"

#include <cmath>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "baseline_scenes.hpp"
#include "catch.hpp"

namespace globalmatch::test_consistent_associations {

using namespace benchmarks;
using scenes::inlier_threshold;

TEST_CASE("the consistent pairs of associations are those of a double loop over all of them") {
  for (const std::size_t stems : {1u, 4u, 12u}) {
    CAPTURE(stems);
    const stem_alignment maps(scenes::small_maps(stems, stems, 0.7), inlier_threshold);
    const consistent_associations associations(maps);
    std::map<std::pair<std::size_t, std::size_t>, double> known;
    for (std::size_t a = 0; a < associations.size(); ++a)
      for (std::size_t b = a + 1; b < associations.size(); ++b) {
        const correspondence first = associations[a], second = associations[b];
        if (first.source == second.source || first.target == second.target) continue;
        const double difference =
            std::abs((maps.source.at[first.source] - maps.source.at[second.source]).xy().norm() -
                     (maps.target.at[first.target] - maps.target.at[second.target]).xy().norm());
        if (difference < inlier_threshold) known[{a, b}] = difference;
      }
    std::size_t visited = 0;
    associations.for_each_pair([&](std::size_t a, std::size_t b, double difference) {
      ++visited;
      const auto pair = known.find({a, b});
      REQUIRE(pair != known.end());
      CHECK(difference == Approx(pair->second).margin(1e-12));
    });
    CHECK(visited == known.size());
    CHECK(associations.count() == known.size());
  }
}

TEST_CASE("a clique of the stems that are common gives their transform, and no clique none") {
  const two_maps equal = scenes::equal_maps(3, 12);
  const stem_alignment maps(equal, inlier_threshold);
  const consistent_associations associations(maps);
  const auto in_scan = [](const position_set& map, stem_index i) -> Eigen::Vector3d {
    return to_eigen(map.frame.local_from_scan()).inverse() * to_eigen(map.at[i]);
  };
  std::vector<correspondence> clique;
  for (std::size_t a = 0; a < associations.size(); ++a) {
    const correspondence c = associations[a];
    const Eigen::Vector3d placed = equal.target_from_source * in_scan(maps.source, c.source);
    if ((placed - in_scan(maps.target, c.target)).norm() < 1e-6) clique.push_back(c);
  }
  REQUIRE(clique.size() == maps.source.size());
  const auto transform = transform_of(maps, clique);
  REQUIRE(transform);
  CHECK(max_error(*transform, equal.target_from_source, equal.source) < 1e-6);
  CHECK_FALSE(transform_of(maps, {}));
  CHECK_FALSE(transform_of(maps, {clique[0]}));
}

}  // namespace globalmatch::test_consistent_associations

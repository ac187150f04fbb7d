#include "globalmatch/detail/survey/find_links.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_find_links {

using namespace detail;

using namespace scenes;

TEST_CASE("links are those of maps that overlap, one a pair, at the right place") {
  random_source random(5);
  const surveyed_grid s(3, 0.01, random);
  std::size_t tried = 0;
  const auto links = find_links(s.maps, overlap_index(s.maps, overlap_cell, {}), -6, {}, tried, {});
  std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
  std::size_t used = 0;
  for (const survey_link& l : links) {
    CHECK(pairs.insert(std::minmax(l.source, l.target)).second);
    if (!l.used) continue;
    ++used;
    const plan_pose placed = s.truth[l.target] * l.target_from_source;
    CHECK((placed * l.center_in_source() - s.truth[l.source] * l.center_in_source()).norm() < 0.05);
    CHECK(l.covariance(2, 2) > 0);
  }
  CHECK(tried >= links.size());
  CHECK(used >= 12);
}

}  // namespace globalmatch::test_find_links

#include "globalmatch/detail/survey/confirm_links.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include "catch.hpp"

namespace globalmatch::detail::test_confirm_links {
namespace {

/// Two maps of six stems each; the first `common` of them are one tree in both.
struct two_linked_maps {
  std::vector<prepared_stems> maps = std::vector<prepared_stems>(2);
  adjusted_survey adjusted;
  std::vector<survey_link> links = std::vector<survey_link>(1);

  explicit two_linked_maps(std::uint32_t common) {
    for (prepared_stems& map : maps) map.stems.at.resize(6);
    auto& trees = adjusted.trees;
    for (std::uint32_t s = 0; s < 6; ++s) {
      trees.stems.push_back({0, s});
      if (s >= common) trees.first.push_back(trees.stems.size());
      trees.stems.push_back({1, s});
      trees.first.push_back(trees.stems.size());
    }
    adjusted.weights.assign(trees.stems.size(), 1);
    links[0].source = 1;
    for (std::uint32_t s = 0; s < 6; ++s) links[0].correspondences.push_back({s, s});
  }
};

}  // namespace

TEST_CASE("a link is confirmed if half of its paired stems are one tree", "[survey]") {
  for (const std::uint32_t common : {0u, 2u, 3u, 6u}) {
    const two_linked_maps given(common);
    CHECK(unconfirmed_links(given.links, given.maps, given.adjusted).size() == (common < 3 ? 1 : 0));
  }
}

TEST_CASE("stems that do not fit their tree confirm nothing", "[survey]") {
  two_linked_maps given(6);
  for (std::size_t i = 0; i < given.adjusted.weights.size(); i += 2) given.adjusted.weights[i] = 0;
  CHECK(unconfirmed_links(given.links, given.maps, given.adjusted) == std::vector<std::size_t>{0});
}

TEST_CASE("links that are not used are not looked at", "[survey]") {
  two_linked_maps given(0);
  given.links[0].used = false;
  CHECK(unconfirmed_links(given.links, given.maps, given.adjusted).empty());
  CHECK(unconfirmed_links({}, {}, adjusted_survey{}).empty());
}

}  // namespace globalmatch::detail::test_confirm_links

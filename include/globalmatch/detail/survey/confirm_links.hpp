// Links of a survey checked by its trees. In: links and adjusted poses. Out: links whose stems are not one
// tree in the end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/adjust_to_trees.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/detail/survey/survey_trees.hpp"

namespace globalmatch::detail {

/// The tree of each stem of each map; `no_tree` where it has none, or does not fit it.
class trees_of_stems {
 public:
  static constexpr std::uint32_t no_tree = ~std::uint32_t(0);

  trees_of_stems(std::span<const prepared_stems> maps, const adjusted_survey& adjusted) {
    std::size_t count = 0;
    for (const prepared_stems& map : maps) {
      first_.push_back(count);
      count += map.stems.size();
    }
    tree_.assign(count, no_tree);
    const tree_observations& trees = adjusted.trees;
    for (std::size_t t = 0; t < trees.size(); ++t)
      for (std::size_t i = trees.first[t]; i < trees.first[t + 1]; ++i)
        if (adjusted.weights[i] > 0)
          tree_[first_[trees.stems[i].map] + trees.stems[i].stem] = std::uint32_t(t);
  }

  std::uint32_t operator()(std::size_t map, std::size_t stem) const { return tree_[first_[map] + stem]; }

 private:
  std::vector<std::size_t> first_;  // stem of each map
  std::vector<std::uint32_t> tree_;
};

/// Links that are used, but most of whose paired stems are not one tree.
inline std::vector<std::size_t> unconfirmed_links(std::span<const survey_link> links,
                                                  std::span<const prepared_stems> maps,
                                                  const adjusted_survey& adjusted) {
  const trees_of_stems tree_of(maps, adjusted);
  std::vector<std::size_t> unconfirmed;
  for (std::size_t i = 0; i < links.size(); ++i) {
    const survey_link& l = links[i];
    std::size_t confirmed = 0;
    for (const correspondence& c : l.correspondences) {
      const std::uint32_t tree = tree_of(l.source, c.source);
      confirmed += tree != trees_of_stems::no_tree && tree == tree_of(l.target, c.target);
    }
    if (l.used && 2 * confirmed < l.correspondences.size()) unconfirmed.push_back(i);
  }
  return unconfirmed;
}

}  // namespace globalmatch::detail

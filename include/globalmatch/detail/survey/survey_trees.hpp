// The trees of a survey: stems of different maps at one place. In: maps with poses. Out: which stems are one
// tree.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/adjust_links.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch::detail {

struct stem_of_map {
  std::uint32_t map;
  stem_index stem;
};

/// Trees as lists of the stems that saw them, one a map, in one flat array.
struct tree_observations {
  std::vector<stem_of_map> stems;        ///< tree by tree
  std::vector<std::size_t> first = {0};  ///< of each tree; one more than trees
  std::size_t size() const { return first.size() - 1; }
  std::span<const stem_of_map> of(std::size_t tree) const {
    return std::span(stems).subspan(first[tree], first[tree + 1] - first[tree]);
  }
};

/// Places of trees as they are found, in cells as wide as they are searched for.
class tree_places {
 public:
  explicit tree_places(double radius) : radius_(radius) {}

  std::size_t size() const { return at_.size(); }

  /// Calls `visit(tree, squared distance)` for those nearer than the radius.
  template <class Visit>
  void for_each_near(const vec2& place, const Visit& visit) const {
    const std::int64_t column = cell(place.x), row = cell(place.y);
    for (std::int64_t c = column - 1; c <= column + 1; ++c)
      for (std::int64_t r = row - 1; r <= row + 1; ++r) {
        if (heads_.empty()) return;
        for (std::uint32_t t = heads_[bucket(c, r)]; t != none; t = next_[t])
          if (cell(at_[t].x) == c && cell(at_[t].y) == r)
            if (const double squared = (at_[t] - place).squared_norm(); squared < radius_ * radius_)
              visit(t, squared);
      }
  }

  std::uint32_t add(const vec2& place) {
    at_.push_back(place);
    next_.push_back(none);
    if (at_.size() > heads_.size())
      rehash();
    else
      link(std::uint32_t(at_.size() - 1));
    return std::uint32_t(at_.size() - 1);
  }

 private:
  static constexpr std::uint32_t none = ~std::uint32_t(0);

  std::int64_t cell(double v) const { return std::int64_t(std::floor(v / radius_)); }
  std::size_t bucket(std::int64_t column, std::int64_t row) const {
    const std::uint64_t hash =
        std::uint64_t(column) * 0x9e3779b97f4a7c15u + std::uint64_t(row) * 0xbf58476d1ce4e5b9u;
    return std::size_t(hash >> 32) & (heads_.size() - 1);
  }
  void link(std::uint32_t tree) {
    std::uint32_t& head = heads_[bucket(cell(at_[tree].x), cell(at_[tree].y))];
    next_[tree] = head;
    head = tree;
  }
  void rehash() {
    heads_.assign(std::max<std::size_t>(64, 4 * heads_.size()), none);
    for (std::uint32_t t = 0; t < at_.size(); ++t) link(t);
  }

  double radius_;
  std::vector<vec2> at_;
  std::vector<std::uint32_t> heads_, next_;  // of the buckets, and of each tree
};

/// Stems near a tree of the maps before are this tree, nearest ones first and one to one; others are new
/// ones. Near is within the root mean square of the `radius` [m] of the map and that of the map that showed
/// the tree first. Maps in `order`, which are those of one component. Cost: linear in the stems.
inline tree_observations find_trees(std::span<const prepared_stems> maps,
                                    std::span<const std::uint32_t> order, std::span<const plan_pose> poses,
                                    std::span<const double> radius) {
  double largest = 0;
  for (const std::uint32_t m : order) largest = std::max(largest, radius[m]);
  tree_places places(largest);
  std::vector<std::vector<stem_of_map>> seen;
  std::vector<keyed> candidates;
  std::vector<std::uint32_t> tree_of, taken_by;
  constexpr std::uint32_t none = ~std::uint32_t(0);
  for (const std::uint32_t m : order) {
    poll_cancelled();
    const auto& at = maps[m].stems.at;
    candidates.clear();
    tree_of.assign(at.size(), none);
    taken_by.resize(places.size(), none);
    for (std::uint32_t s = 0; s < at.size(); ++s)
      places.for_each_near(poses[m] * at[s].xy(), [&](std::uint32_t tree, double squared) {
        const double other = radius[seen[tree].front().map];
        if (2 * squared < radius[m] * radius[m] + other * other)
          candidates.push_back({key_of(squared), key_of(s, tree)});
      });
    sort_keyed(candidates);
    for (const keyed& c : candidates) {
      const std::uint32_t s = first_of(c.value), tree = second_of(c.value);
      if (tree_of[s] != none || taken_by[tree] == m) continue;
      tree_of[s] = tree;
      taken_by[tree] = m;
    }
    for (std::uint32_t s = 0; s < at.size(); ++s) {
      if (tree_of[s] == none) {
        tree_of[s] = places.add(poses[m] * at[s].xy());
        seen.emplace_back();
      }
      seen[tree_of[s]].push_back({m, s});
    }
  }
  tree_observations trees;
  for (const auto& of_tree : seen) {
    trees.stems.insert(trees.stems.end(), of_tree.begin(), of_tree.end());
    trees.first.push_back(trees.stems.size());
  }
  return trees;
}

/// The unknowns that have trees in common, each pair once.
inline std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_of_maps(const tree_observations& trees,
                                                                          const unknown_poses& unknowns) {
  constexpr std::size_t at_once = 1'000'000;
  std::vector<std::uint64_t> all;
  const auto keep_unique = [&] {
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
  };
  for (std::size_t t = 0, limit = at_once; t < trees.size(); ++t) {
    const auto seen = trees.of(t);
    for (std::size_t i = 0; i < seen.size(); ++i)
      for (std::size_t k = 0; k < i; ++k) {
        const std::uint32_t a = unknowns.of[seen[i].map], b = unknowns.of[seen[k].map];
        if (a != unknown_poses::fixed && b != unknown_poses::fixed)
          all.push_back(key_of(std::max(a, b), std::min(a, b)));
      }
    if (all.size() > limit) keep_unique(), limit = 2 * all.size() + at_once;
  }
  keep_unique();
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  pairs.reserve(all.size());
  for (const std::uint64_t key : all) pairs.emplace_back(first_of(key), second_of(key));
  return pairs;
}

/// Standard deviation of errors in that of residuals, which are smaller where few numbers determine many
/// unknowns: by so many numbers more than trees have coordinates.
inline double growth_of_residuals(double redundancy, double unknowns) {
  return std::sqrt(redundancy / std::max(1.0, redundancy - unknowns));
}

}  // namespace globalmatch::detail

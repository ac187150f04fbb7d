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

#include "globalmatch/detail/core/growing_grid.hpp"
#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/core/rigid.hpp"
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
  explicit tree_places(double radius) : radius_(radius), grid_(radius) {}

  std::size_t size() const { return grid_.size(); }

  /// Calls `visit(tree, squared distance)` for those nearer than the radius.
  template <class Visit>
  void for_each_near(const vec2& place, const Visit& visit) const {
    grid_.for_each_near({place.x, place.y}, radius_, [&](const auto& item) {
      const vec2 at = {item.at[0], item.at[1]};
      if (const double squared = (at - place).squared_norm(); squared < radius_ * radius_)
        visit(item.label, squared);
    });
  }

  std::uint32_t add(const vec2& place) {
    const auto tree = std::uint32_t(size());
    grid_.add({{place.x, place.y}, tree});
    return tree;
  }

 private:
  double radius_;
  growing_grid<double, 2> grid_;
};

/// Which trees the stems of maps are, map by map.
class tree_matcher {
 public:
  static constexpr std::uint32_t no_tree = ~std::uint32_t(0);

  /// Stems near a tree are this tree, nearest ones first and one to one; `no_tree` for others. Near is within
  /// the root mean square of the `radius` [m] of the map and that of a tree, `radius_of(tree)`.
  template <class RadiusOf>
  std::span<const std::uint32_t> operator()(const prepared_stems& map, const plan_pose& pose, double radius,
                                            const tree_places& places, const RadiusOf& radius_of) {
    const auto& at = map.stems.at;
    ++map_;
    candidates_.clear();
    tree_of_.assign(at.size(), no_tree);
    taken_by_.resize(places.size(), 0);
    for (std::uint32_t s = 0; s < at.size(); ++s)
      places.for_each_near(pose * at[s].xy(), [&](std::uint32_t tree, double squared) {
        const double other = radius_of(tree);
        if (2 * squared < radius * radius + other * other)
          candidates_.push_back({key_of(squared), key_of(s, tree)});
      });
    sort_keyed(candidates_);
    for (const keyed& c : candidates_) {
      const std::uint32_t s = first_of(c.value), tree = second_of(c.value);
      if (tree_of_[s] != no_tree || taken_by_[tree] == map_) continue;
      tree_of_[s] = tree;
      taken_by_[tree] = map_;
    }
    return tree_of_;
  }

 private:
  std::uint32_t map_ = 0;  // number of the map at work
  std::vector<keyed> candidates_;
  std::vector<std::uint32_t> tree_of_, taken_by_;  // each stem; each tree
};

/// Stems near a tree of the maps before are this tree, others are new ones, at the place of that stem. The
/// `radius` [m] of a tree is that of the map that showed it first. Maps in `order`, which are those of one
/// component. Cost: linear in the stems.
inline tree_observations find_trees(std::span<const prepared_stems> maps,
                                    std::span<const std::uint32_t> order, std::span<const plan_pose> poses,
                                    std::span<const double> radius) {
  double largest = 0;
  for (const std::uint32_t m : order) largest = std::max(largest, radius[m]);
  tree_places places(largest);
  tree_matcher trees_of;
  std::vector<std::vector<stem_of_map>> seen;
  for (const std::uint32_t m : order) {
    poll_cancelled();
    const auto& at = maps[m].stems.at;
    const auto found = trees_of(maps[m], poses[m], radius[m], places,
                                [&](std::uint32_t tree) { return radius[seen[tree].front().map]; });
    for (std::uint32_t s = 0; s < at.size(); ++s) {
      std::uint32_t tree = found[s];
      if (tree == tree_matcher::no_tree) {
        tree = places.add(poses[m] * at[s].xy());
        seen.emplace_back();
      }
      seen[tree].push_back({m, s});
    }
  }
  tree_observations trees;
  for (const auto& of_tree : seen) {
    trees.stems.insert(trees.stems.end(), of_tree.begin(), of_tree.end());
    trees.first.push_back(trees.stems.size());
  }
  return trees;
}

/// The trees that the stems of a further map are. Trees of which `is_near(map)` says that the map that showed
/// them first is elsewhere are not looked at.
template <class IsNear>
std::vector<std::uint32_t> trees_of_map(std::span<const prepared_stems> maps, std::uint32_t map,
                                        std::span<const plan_pose> poses, std::span<const double> radius,
                                        const tree_observations& trees, const IsNear& is_near) {
  tree_places places(*std::max_element(radius.begin(), radius.end()));
  std::vector<std::uint32_t> near;
  for (std::uint32_t t = 0; t < trees.size(); ++t) {
    const stem_of_map& first = trees.of(t).front();
    if (!is_near(first.map)) continue;
    near.push_back(t);
    places.add(poses[first.map] * maps[first.map].stems.at[first.stem].xy());
  }
  tree_matcher match;
  const auto found = match(maps[map], poses[map], radius[map], places,
                           [&](std::uint32_t i) { return radius[trees.of(near[i]).front().map]; });
  std::vector<std::uint32_t> tree_of;
  for (const std::uint32_t i : found) tree_of.push_back(i == tree_matcher::no_tree ? i : near[i]);
  return tree_of;
}

/// The stem of a map that is each tree, and its own stems that are none.
struct stems_of_trees {
  static constexpr stem_index no_stem = ~stem_index(0);
  std::vector<stem_index> of_tree, others;

  stems_of_trees(std::size_t trees, std::span<const std::uint32_t> tree_of) : of_tree(trees, no_stem) {
    for (stem_index s = 0; s < tree_of.size(); ++s)
      if (tree_of[s] == tree_matcher::no_tree)
        others.push_back(s);
      else
        of_tree[tree_of[s]] = s;
  }
};

/// Trees that a further map shows as well, with its stem the last one of each. `tree_of`: each of its stems.
inline tree_observations trees_in_common(const tree_observations& trees, std::uint32_t map,
                                         std::span<const std::uint32_t> tree_of) {
  const stems_of_trees stems(trees.size(), tree_of);
  tree_observations common;
  for (std::size_t t = 0; t < trees.size(); ++t) {
    if (stems.of_tree[t] == stems_of_trees::no_stem) continue;
    common.stems.insert(common.stems.end(), trees.of(t).begin(), trees.of(t).end());
    common.stems.push_back({map, stems.of_tree[t]});
    common.first.push_back(common.stems.size());
  }
  return common;
}

/// All trees, with the stems of a further map, and a number of each of their stems; `of_stem`: those of the
/// map.
inline tree_observations with_further_map(const tree_observations& trees, std::uint32_t map,
                                          std::span<const std::uint32_t> tree_of,
                                          std::span<const double> of_stem, std::vector<double>& numbers) {
  const stems_of_trees stems(trees.size(), tree_of);
  tree_observations all;
  std::vector<double> of_all;
  all.stems.reserve(trees.stems.size() + tree_of.size());
  all.first.reserve(trees.first.size() + stems.others.size());
  of_all.reserve(trees.stems.size() + tree_of.size());
  const auto add = [&](stem_index s) {
    all.stems.push_back({map, s});
    of_all.push_back(of_stem[s]);
  };
  for (std::size_t t = 0; t < trees.size(); ++t) {
    all.stems.insert(all.stems.end(), trees.of(t).begin(), trees.of(t).end());
    of_all.insert(of_all.end(), numbers.begin() + std::ptrdiff_t(trees.first[t]),
                  numbers.begin() + std::ptrdiff_t(trees.first[t + 1]));
    if (stems.of_tree[t] != stems_of_trees::no_stem) add(stems.of_tree[t]);
    all.first.push_back(all.stems.size());
  }
  for (const stem_index s : stems.others) {
    add(s);
    all.first.push_back(all.stems.size());
  }
  numbers = std::move(of_all);
  return all;
}

/// Where poses have the stems of trees [m], in the order of these.
inline std::vector<vec2> placed_stems(std::span<const prepared_stems> maps, const tree_observations& trees,
                                      std::span<const plan_pose> poses) {
  std::vector<mat3> turns;
  for (const plan_pose& pose : poses) turns.push_back(rotation_about_z(pose.yaw));
  std::vector<vec2> placed;
  placed.reserve(trees.stems.size());
  for (const stem_of_map& o : trees.stems)
    placed.push_back((turns[o.map] * maps[o.map].stems.at[o.stem]).xy() + poses[o.map].shift);
  return placed;
}

/// The unknowns that have trees in common, each pair once.
inline std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_of_maps(const tree_observations& trees,
                                                                          const unknown_poses& unknowns) {
  std::vector<std::size_t> first(unknowns.count + 1, 0);
  const auto for_each = [&](const auto& visit) {
    for (std::uint32_t t = 0; t < trees.size(); ++t)
      for (const stem_of_map& o : trees.of(t))
        if (unknowns.of[o.map] != unknown_poses::fixed) visit(unknowns.of[o.map], t);
  };
  for_each([&](std::uint32_t unknown, std::uint32_t) { ++first[unknown + 1]; });
  for (std::size_t u = 0; u < unknowns.count; ++u) first[u + 1] += first[u];
  std::vector<std::uint32_t> trees_of(first.back());
  std::vector<std::size_t> end(first.begin(), first.end() - 1);
  for_each([&](std::uint32_t unknown, std::uint32_t tree) { trees_of[end[unknown]++] = tree; });

  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  std::vector<std::uint32_t> found_by(unknowns.count, unknown_poses::fixed);
  for (std::uint32_t u = 0; u < unknowns.count; ++u)
    for (std::size_t i = first[u]; i < first[u + 1]; ++i)
      for (const stem_of_map& o : trees.of(trees_of[i]))
        if (const std::uint32_t other = unknowns.of[o.map]; other < u && found_by[other] != u) {
          found_by[other] = u;
          pairs.emplace_back(u, other);
        }
  return pairs;
}

/// Standard deviation of errors in that of residuals, which are smaller where few numbers determine many
/// unknowns: by so many numbers more than trees have coordinates.
inline double growth_of_residuals(double redundancy, double unknowns) {
  return std::sqrt(redundancy / std::max(1.0, redundancy - unknowns));
}

}  // namespace globalmatch::detail

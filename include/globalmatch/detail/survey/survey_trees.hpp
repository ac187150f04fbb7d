// The trees of a survey: stems of different maps at one place. In: maps with poses. Out: which stems are one
// tree, and the poses adjusted with the trees as landmarks.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/robust.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/adjust_links.hpp"
#include "globalmatch/detail/survey/block_system.hpp"
#include "globalmatch/detail/survey/link_graph.hpp"
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

/// Stems within `radius` [m] of a tree of the maps before are this tree, nearest ones first and one to one;
/// others are new ones. Maps in `order`, which are those of one component. Cost: linear in the stems.
inline tree_observations find_trees(std::span<const prepared_stems> maps,
                                    std::span<const std::uint32_t> order, std::span<const plan_pose> poses,
                                    double radius) {
  tree_places places(radius);
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

/// The adjustment of poses in plan to trees, whose places are eliminated. Refers to all that it is given.
class tree_adjustment {
 public:
  /// `sigma` [m] of stems in plan, along each axis, where they do not know it themselves.
  tree_adjustment(std::span<const prepared_stems> maps, const tree_observations& trees,
                  const unknown_poses& unknowns, double sigma)
      : maps_(maps),
        trees_(trees),
        unknowns_(unknowns),
        sigma_(sigma),
        system_(unknowns.count, pairs_of_maps(trees, unknowns)) {
    weights_.assign(trees.stems.size(), 1);
  }

  /// Moves the poses until convergence; observations that do not fit their tree lose their weight. False
  /// where the trees do not determine all of them.
  bool adjust(std::span<plan_pose> poses) {
    constexpr int max_iterations = 20;
    constexpr double converged = 1e-5;  // [m]
    for (int iteration = 0; iteration < max_iterations; ++iteration) {
      poll_cancelled();
      reweight(poses);
      fill(poses);
      if (unknowns_.count == 0) return true;
      if (!system_.factorize()) return false;
      if (move_poses(poses, unknowns_, system_.solve()) < converged) break;
    }
    return true;
  }

  /// Standard deviation [m] of an observation along each axis, once adjusted.
  double sigma() const { return sigma_; }
  /// Of the observations of all trees, in their order: 0 for those that belong to none.
  std::span<const double> weights() const { return weights_; }

  /// Covariances of shift and yaw of the poses, along the axes of the survey; 0 of fixed ones. After
  /// `adjust`.
  std::vector<mat3> covariances() const {
    std::vector<mat3> result(unknowns_.of.size());
    if (unknowns_.count == 0) return result;
    const auto blocks = system_.inverse_blocks();
    for (std::size_t m = 0; m < result.size(); ++m)
      if (unknowns_.of[m] != unknown_poses::fixed)
        for (int c = 0; c < 3; ++c)
          for (int r = 0; r < 3; ++r) result[m](r, c) = blocks[unknowns_.of[m]](r, c) * sigma_ * sigma_;
    return result;
  }

  /// Weighted mean [m] of where the stems of a tree are; nothing counts more than once.
  vec2 place_of(std::size_t tree, std::span<const plan_pose> poses) const {
    vec2 sum = vec2{};
    double total = 0;
    for (std::size_t i = trees_.first[tree]; i < trees_.first[tree + 1]; ++i) {
      sum += weight(i) * placed(i, poses);
      total += weight(i);
    }
    return total > 0 ? sum / total : placed(trees_.first[tree], poses);
  }
  /// Of the weights of a tree's observations, each at most 1.
  double total_weight(std::size_t tree) const {
    double total = 0;
    for (std::size_t i = trees_.first[tree]; i < trees_.first[tree + 1]; ++i) total += weight(i);
    return total;
  }

 private:
  vec2 placed(std::size_t i, std::span<const plan_pose> poses) const {
    const stem_of_map& o = trees_.stems[i];
    return poses[o.map] * maps_[o.map].stems.at[o.stem].xy();
  }
  double weight(std::size_t i) const { return weights_[i]; }

  /// Weights follow the residuals; their deviation is estimated from the median of all.
  void reweight(std::span<const plan_pose> poses) {
    constexpr double min_sigma = 1e-4;               // [m]
    constexpr double median_of_chi_squared = 1.386;  // of two degrees of freedom
    std::vector<double> squares(trees_.stems.size(), 0), sample;
    for (std::size_t t = 0; t < trees_.size(); ++t) {
      const std::size_t seen = trees_.first[t + 1] - trees_.first[t];
      if (seen < 2) continue;
      const vec2 place = place_of(t, poses);
      const double of_mean = double(seen) / double(seen - 1);  // which is nearer to its stems than the tree
      for (std::size_t i = trees_.first[t]; i < trees_.first[t + 1]; ++i) {
        squares[i] = (placed(i, poses) - place).squared_norm() * of_mean;
        sample.push_back(squares[i]);
      }
    }
    if (sample.empty()) return;
    sigma_ = std::max(min_sigma, std::sqrt(median(sample) / median_of_chi_squared));
    for (std::size_t i = 0; i < squares.size(); ++i)
      weights_[i] = tukey_weight(squares[i] / (sigma_ * sigma_ * tukey_constant * tukey_constant));
  }

  void fill(std::span<const plan_pose> poses) {
    using matrix = block_system<3>::block;
    using jacobian = Eigen::Matrix<double, 2, 3>;
    system_.set_zero();
    system_.add_on_diagonal(damping);
    std::vector<jacobian> of_pose;
    for (std::size_t t = 0; t < trees_.size(); ++t) {
      const std::size_t begin = trees_.first[t], end = trees_.first[t + 1];
      const double total = total_weight(t);
      if (end - begin < 2 || !(total > 0)) continue;
      const vec2 place = place_of(t, poses);
      of_pose.clear();
      for (std::size_t i = begin; i < end; ++i) {
        const vec2 at = placed(i, poses), lever = quarter_turned(at - poses[trees_.stems[i].map].shift);
        jacobian j;
        j << 1, 0, lever.x, 0, 1, lever.y;
        of_pose.push_back(j);
      }
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t own = unknowns_.of[trees_.stems[i].map];
        if (own == unknown_poses::fixed || !(weight(i) > 0)) continue;
        const jacobian& j = of_pose[i - begin];
        const vec2 off = placed(i, poses) - place;
        system_.add_right(own, -weight(i) * (j.transpose() * Eigen::Vector2d(off.x, off.y)));
        for (std::size_t k = begin; k < end; ++k) {
          const std::uint32_t other = unknowns_.of[trees_.stems[k].map];
          if (other == unknown_poses::fixed || other > own || !(weight(k) > 0)) continue;
          const double factor = (k == i ? weight(i) : 0) - weight(i) * weight(k) / total;
          const matrix product = j.transpose() * of_pose[k - begin];
          system_.add(own, other, factor * product);
        }
      }
    }
  }

  std::span<const prepared_stems> maps_;
  const tree_observations& trees_;
  const unknown_poses& unknowns_;
  double sigma_;
  std::vector<double> weights_;
  block_system<3> system_;
};

}  // namespace globalmatch::detail

// Heights of the maps of a survey, once they are placed in plan: from the heights of the trees that they have
// in common.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/disjoint_sets.hpp"
#include "globalmatch/detail/core/robust.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/block_system.hpp"
#include "globalmatch/detail/survey/known_poses.hpp"
#include "globalmatch/detail/survey/link_graph.hpp"
#include "globalmatch/detail/survey/survey_trees.hpp"

namespace globalmatch::detail {

struct survey_heights {
  std::vector<double> of_map;       ///< [m] by which each is raised
  std::vector<double> sigma;        ///< [m] of these, against the datum of the component
  std::vector<std::uint8_t> known;  ///< by trees in common with the datum, or with maps that have some
  double stem_sigma = 0;            ///< [m] of a stem's height
  std::vector<double> weights;      ///< of the observations of the trees
};

/// The maps of each component that the heights of others refer to: fixed ones that have any, else the first
/// one that has, or the first one. `members`: the maps of each, the reference first.
inline std::vector<std::uint32_t> height_datums(std::span<const prepared_stems> maps,
                                                const std::vector<std::vector<std::uint32_t>>& members,
                                                const known_poses& known) {
  std::vector<std::uint32_t> datums;
  for (const auto& of_component : members) {
    const std::size_t before = datums.size();
    for (const std::uint32_t m : of_component)
      if (known.is_fixed(m) && maps[m].stems.has_heights) datums.push_back(m);
    if (datums.size() > before) continue;
    const auto first = std::find_if(of_component.begin(), of_component.end(),
                                    [&](std::uint32_t m) { return maps[m].stems.has_heights; });
    datums.push_back(first == of_component.end() ? of_component.front() : *first);
  }
  return datums;
}

/// Heights along the links that are used, by the median of the paired stems, from the maps of `open` on,
/// whose heights are known.
inline void heights_along_links(std::span<const prepared_stems> maps, const link_graph& graph,
                                std::vector<std::uint32_t> open, survey_heights& heights) {
  for (std::size_t next = 0; next < open.size(); ++next) {
    const std::uint32_t m = open[next];
    for (const auto& e : graph.of(m)) {
      if (heights.known[e.neighbor] || !maps[e.neighbor].stems.has_heights) continue;
      const survey_link& l = graph.link(e);
      std::vector<double> above;  // the neighbor's stems, those of `m`
      for (const correspondence& c : l.correspondences) {
        const double of_source = maps[l.source].stems.at[c.source].z,
                     of_target = maps[l.target].stems.at[c.target].z;
        above.push_back(l.source == m ? of_target - of_source : of_source - of_target);
      }
      heights.of_map[e.neighbor] = heights.of_map[m] - median(above);
      heights.known[e.neighbor] = true;
      open.push_back(e.neighbor);
    }
  }
}

/// The adjustment of heights to those of trees, which are eliminated. Refers to all that it is given.
class height_adjustment {
 public:
  height_adjustment(std::span<const prepared_stems> maps, const tree_observations& trees,
                    const unknown_poses& unknowns, survey_heights& heights)
      : maps_(maps),
        trees_(trees),
        unknowns_(unknowns),
        heights_(heights),
        system_(unknowns.count, pairs_of_maps(trees, unknowns)) {
    heights_.weights.assign(trees.stems.size(), 0);
    for (std::size_t i = 0; i < trees.stems.size(); ++i)
      heights_.weights[i] = heights_.known[trees.stems[i].map] ? 1 : 0;
  }

  /// False where the trees do not determine all heights; those that they do not are not known any more.
  bool adjust(int max_iterations) {
    constexpr double converged = 1e-5;  // [m]
    for (int iteration = 0; iteration < max_iterations; ++iteration) {
      poll_cancelled();
      reweight();
      if (unknowns_.count == 0) return true;
      if (forget_unconnected()) return false;
      fill();
      if (!system_.factorize()) {
        for (std::size_t m = 0; m < maps_.size(); ++m)
          if (unknowns_.of[m] != unknown_poses::fixed) heights_.known[m] = false;
        return false;
      }
      const Eigen::VectorXd change = system_.solve();
      for (std::size_t m = 0; m < maps_.size(); ++m)
        if (unknowns_.of[m] != unknown_poses::fixed)
          heights_.of_map[m] += change[Eigen::Index(unknowns_.of[m])];
      if (change.cwiseAbs().maxCoeff() < converged) break;
    }
    const auto variances = system_.inverse_blocks();
    for (std::size_t m = 0; m < maps_.size(); ++m)
      if (unknowns_.of[m] != unknown_poses::fixed)
        heights_.sigma[m] = heights_.stem_sigma * std::sqrt(variances[unknowns_.of[m]](0, 0));
    return true;
  }

 private:
  double placed(std::size_t i) const {
    const stem_of_map& o = trees_.stems[i];
    return maps_[o.map].stems.at[o.stem].z + heights_.of_map[o.map];
  }

  /// Mean height [m] of a tree, and the sum of its weights.
  std::pair<double, double> mean(std::size_t tree) const {
    double sum = 0, total = 0;
    for (std::size_t i = trees_.first[tree]; i < trees_.first[tree + 1]; ++i)
      sum += heights_.weights[i] * placed(i), total += heights_.weights[i];
    return {total > 0 ? sum / total : 0, total};
  }

  void reweight() {
    constexpr double min_sigma = 1e-3;  // [m]
    std::vector<double> off(trees_.stems.size(), 0), sample, of_tree;
    double redundancy = 0;
    for (std::size_t t = 0; t < trees_.size(); ++t) {
      of_tree.clear();
      for (std::size_t i = trees_.first[t]; i < trees_.first[t + 1]; ++i)
        if (heights_.known[trees_.stems[i].map]) of_tree.push_back(placed(i));
      if (of_tree.size() < 2) continue;
      // From differences: of an odd number of heights one is the median, and 0 off.
      for (std::size_t k = 1; k < of_tree.size(); ++k)
        sample.push_back(std::abs(of_tree[k] - of_tree[k - 1]) / std::numbers::sqrt2);
      const double count = double(of_tree.size()), middle = median(of_tree);
      for (std::size_t i = trees_.first[t]; i < trees_.first[t + 1]; ++i)
        if (heights_.known[trees_.stems[i].map])
          off[i] = (placed(i) - middle) * std::sqrt(count / (count - 1));
      redundancy += count - 1;
    }
    if (sample.empty()) return;
    heights_.stem_sigma = std::max(min_sigma, deviation_of_median * median(sample) *
                                                  growth_of_residuals(redundancy, double(unknowns_.count)));
    const double largest = tukey_constant * heights_.stem_sigma;
    for (std::size_t i = 0; i < off.size(); ++i)
      if (heights_.known[trees_.stems[i].map])
        heights_.weights[i] = tukey_weight(off[i] * off[i] / (largest * largest));
  }

  /// Takes the heights for unknown that no trees connect with a fixed one, and says whether there are any.
  bool forget_unconnected() {
    constexpr double min_weight = 1e-3;
    disjoint_sets connected(maps_.size());
    for (std::size_t t = 0; t < trees_.size(); ++t) {
      const stem_of_map* first = nullptr;
      for (std::size_t i = trees_.first[t]; i < trees_.first[t + 1]; ++i) {
        if (!(heights_.weights[i] > min_weight)) continue;
        if (first) connected.join(trees_.stems[i].map, first->map);
        first = &trees_.stems[i];
      }
    }
    std::vector<std::uint8_t> is_fixed(maps_.size());
    for (std::uint32_t m = 0; m < maps_.size(); ++m)
      if (unknowns_.of[m] == unknown_poses::fixed && heights_.known[m]) is_fixed[connected.find(m)] = true;
    bool any = false;
    for (std::uint32_t m = 0; m < maps_.size(); ++m)
      if (heights_.known[m] && !is_fixed[connected.find(m)]) heights_.known[m] = false, any = true;
    return any;
  }

  void fill() {
    system_.set_zero();
    for (std::size_t t = 0; t < trees_.size(); ++t) {
      const auto [middle, total] = mean(t);
      if (!(total > 0)) continue;
      for (std::size_t i = trees_.first[t]; i < trees_.first[t + 1]; ++i) {
        const std::uint32_t own = unknowns_.of[trees_.stems[i].map];
        const double weight = heights_.weights[i];
        if (own == unknown_poses::fixed || !(weight > 0)) continue;
        add_right(own, -weight * (placed(i) - middle));
        for (std::size_t k = trees_.first[t]; k < trees_.first[t + 1]; ++k) {
          const std::uint32_t other = unknowns_.of[trees_.stems[k].map];
          if (other == unknown_poses::fixed || other > own || !(heights_.weights[k] > 0)) continue;
          add(own, other, (k == i ? weight : 0) - weight * heights_.weights[k] / total);
        }
      }
    }
  }
  void add_right(std::size_t row, double summand) {
    system_.add_right(row, block_system<1>::vector::Constant(summand));
  }
  void add(std::size_t row, std::size_t column, double summand) {
    system_.add(row, column, block_system<1>::block::Constant(summand));
  }

  std::span<const prepared_stems> maps_;
  const tree_observations& trees_;
  const unknown_poses& unknowns_;
  survey_heights& heights_;
  block_system<1> system_;
};

/// Raises the last map to the trees that others show, whose heights are held.
inline void fit_last_height(std::span<const prepared_stems> maps, const tree_observations& trees,
                            const survey_heights& heights, double& of_last, int max_iterations) {
  const std::size_t last = maps.size() - 1;
  tree_observations own;
  for (std::size_t t = 0; t < trees.size(); ++t) {
    if (trees.of(t).back().map != last) continue;  // it was added last
    own.stems.insert(own.stems.end(), trees.of(t).begin(), trees.of(t).end());
    own.first.push_back(own.stems.size());
  }
  survey_heights fitted = heights;
  const unknown_poses unknowns(maps.size(), [&](std::size_t m) { return m != last || !heights.known[m]; });
  if (height_adjustment(maps, own, unknowns, fitted).adjust(max_iterations)) of_last = fitted.of_map[last];
}

/// The heights of maps, and what is known of them. Unknown ones are guesses. `members`: the maps of each
/// component, the reference first. `before`: heights of all maps but the last one, which
/// are soon adjusted to it.
inline survey_heights find_heights(std::span<const prepared_stems> maps, const tree_observations& trees,
                                   const link_graph& used,
                                   const std::vector<std::vector<std::uint32_t>>& members,
                                   const known_poses& known = {}, const survey_heights* before = nullptr) {
  constexpr int max_iterations = 10, max_further_iterations = 1;
  const std::vector<std::uint32_t> datums = height_datums(maps, members, known);
  survey_heights heights;
  heights.of_map.assign(maps.size(), 0);
  heights.sigma.assign(maps.size(), 0);
  heights.known.assign(maps.size(), 0);
  for (const auto& of_component : members)
    for (const std::uint32_t m : of_component)
      if (known.is_fixed(m))
        heights.of_map[m] = known.transform_beside(of_component.front(), m).translation.z;
  std::vector<std::uint8_t> is_datum(maps.size());
  std::vector<std::uint32_t> open;
  for (const std::uint32_t m : datums) {
    is_datum[m] = true;
    if (maps[m].stems.has_heights) heights.known[m] = true, open.push_back(m);
  }
  for (std::uint32_t m = 0; before && m < before->of_map.size(); ++m) {
    if (heights.known[m] || !before->known[m]) continue;
    heights.of_map[m] = before->of_map[m];
    heights.known[m] = true;
    open.push_back(m);
  }
  heights_along_links(maps, used, std::move(open), heights);
  if (before && !is_datum[maps.size() - 1])
    fit_last_height(maps, trees, heights, heights.of_map.back(), max_iterations);
  while (true) {  // with ever fewer heights that are known
    const unknown_poses unknowns(maps.size(),
                                 [&](std::size_t m) { return is_datum[m] || !heights.known[m]; });
    if (height_adjustment(maps, trees, unknowns, heights)
            .adjust(before ? max_further_iterations : max_iterations))
      return heights;
  }
}

}  // namespace globalmatch::detail

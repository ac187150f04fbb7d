// Pairs of scans of a survey that have trees in common.
#pragma once

#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/disjoint_sets.hpp"
#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/survey/pose_uncertainty.hpp"
#include "globalmatch/refinement_options.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch::detail {

/// Two scans, the first with the lower number, and how many trees both see.
struct scans_in_common {
  std::uint32_t first, second;
  std::size_t trees;
};

/// All pairs of placed scans that see a tree in common, by their numbers; a link by stems that is used counts
/// as one.
inline std::vector<scans_in_common> all_in_common(const survey& s) {
  std::vector<std::uint64_t> keys;
  for (const survey::link& l : s.links)
    if (l.used && l.targets == 0)
      keys.push_back(
          key_of(std::uint32_t(std::min(l.source, l.target)), std::uint32_t(std::max(l.source, l.target))));
  for (const survey::tree& t : s.trees)
    for (std::size_t i = 0; i < t.seen.size(); ++i)
      for (std::size_t k = 0; k < i; ++k)
        keys.push_back(key_of(std::uint32_t(std::min(t.seen[i].scan, t.seen[k].scan)),
                              std::uint32_t(std::max(t.seen[i].scan, t.seen[k].scan))));
  std::sort(keys.begin(), keys.end());
  std::vector<scans_in_common> pairs;
  for (const std::uint64_t key : keys) {
    if (pairs.empty() || key_of(pairs.back().first, pairs.back().second) != key)
      pairs.push_back({first_of(key), second_of(key), 0});
    ++pairs.back().trees;
  }
  return pairs;
}

/// For each scan the `count` pairs of most trees, and those that connect all.
inline std::vector<scans_in_common> best_in_common(std::vector<scans_in_common> pairs, std::size_t scans,
                                                   std::size_t count) {
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const auto& a, const auto& b) { return a.trees > b.trees; });
  disjoint_sets connected(scans);
  std::vector<std::size_t> taken(scans, 0);
  std::vector<scans_in_common> best;
  for (const scans_in_common& p : pairs) {
    std::size_t &of_first = taken[p.first], &of_second = taken[p.second];
    const bool connects = connected.join(p.first, p.second);
    if (connects || of_first < count || of_second < count) best.push_back(p);
    ++of_first, ++of_second;
  }
  return best;
}

/// How two scans are placed against each other: errors of both poses are taken for independent, which makes
/// them larger than they are.
inline pair_to_refine placed_pair(const survey& s, std::size_t source, std::size_t target) {
  const survey::scan &from = s.scans[source], &to = s.scans[target];
  const Eigen::Isometry3d target_from_survey = to.survey_from_scan.inverse();
  pair_to_refine pair{source, target, target_from_survey * from.survey_from_scan, {}, false};
  transform_uncertainty both = sum_of(*from.uncertainty, *to.uncertainty);
  both = about(both, 0.5 * (from.uncertainty->center + to.uncertainty->center));
  pair.uncertainty = in_frame(both, target_from_survey);
  pair.is_height_known = from.is_height_known && to.is_height_known;
  return pair;
}

/// `pairs_to_refine`: `count` a scan, none of them with those `without_samples`.
inline std::vector<pair_to_refine> pairs_in_common(const survey& s, std::size_t count,
                                                   std::span<const std::size_t> without_samples = {}) {
  std::vector<std::uint8_t> has_samples(s.scans.size(), true);
  for (const std::size_t scan : without_samples)
    if (scan < has_samples.size()) has_samples[scan] = false;
  std::vector<scans_in_common> in_common = all_in_common(s);
  std::erase_if(in_common, [&](const auto& p) { return !has_samples[p.first] || !has_samples[p.second]; });
  std::vector<pair_to_refine> pairs;
  for (const scans_in_common& p : best_in_common(std::move(in_common), s.scans.size(), count))
    if (s.scans[p.first].uncertainty && s.scans[p.second].uncertainty)
      pairs.push_back(placed_pair(s, p.second, p.first));
  std::sort(pairs.begin(), pairs.end(), [](const pair_to_refine& a, const pair_to_refine& b) {
    return a.source != b.source ? a.source < b.source : a.target < b.target;
  });
  return pairs;
}

}  // namespace globalmatch::detail

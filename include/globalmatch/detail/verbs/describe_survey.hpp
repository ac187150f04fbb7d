// What is reported of a survey, in the frames and indices of the caller.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/matching/uncertainty.hpp"
#include "globalmatch/detail/survey/adjust_to_trees.hpp"
#include "globalmatch/detail/survey/link_graph.hpp"
#include "globalmatch/detail/survey/place_maps.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/split_check.hpp"
#include "globalmatch/detail/survey/survey_heights.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch::detail {

/// All that a survey found, in levelled local frames.
struct local_survey {
  std::span<const prepared_stems> maps;
  std::vector<survey_link> links;
  placed_maps placed;
  std::vector<std::vector<std::uint32_t>> members;  ///< maps of each component
  adjusted_survey adjusted;
  survey_heights heights;

  const prepared_stems& reference_of(std::size_t map) const {
    return maps[placed.parts.reference[placed.parts.of[map]]];
  }
  /// From the local frame of a map to the frame of the reference's scan.
  Eigen::Isometry3d survey_from_scan(std::size_t map, const plan_pose& pose) const {
    return to_eigen(reference_of(map).stems.frame.local_from_scan().inverse() *
                    in_space(pose, heights.of_map[map]) * maps[map].stems.frame.local_from_scan());
  }
  bool is_height_known(std::size_t map) const { return heights.known[map] != 0; }
};

/// Variance [m^2] of a height that is not known: that of a kilometre.
inline constexpr double unknown_height_variance = 1e6;

/// The uncertainty of a pose at the centroid of its stems.
inline transform_uncertainty uncertainty_of(const local_survey& s, std::size_t map) {
  const auto& at = s.maps[map].stems.at;
  vec3 centroid;
  for (const vec3& p : at) centroid += p / double(at.size());
  const plan_pose& pose = s.adjusted.poses[map];
  const vec2 center = pose * centroid.xy(), lever = quarter_turned(center - pose.shift);
  const mat3 at_center = mat3::rows_of({1, 0, lever.x}, {0, 1, lever.y}, {0, 0, 1});
  const mat3 there = at_center * s.adjusted.covariance[map] * at_center.transpose();
  local_uncertainty local;
  local.center = {center.x, center.y, centroid.z + s.heights.of_map[map]};
  local.covariance.size = 4;
  const std::size_t of[3] = {0, 1, 3};
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) local.covariance(of[r], of[c]) = there(r, c);
  local.covariance(2, 2) =
      s.is_height_known(map) ? s.heights.sigma[map] * s.heights.sigma[map] : unknown_height_variance;
  return in_caller_frame(local, s.reference_of(map).stems.frame);
}

/// Why a map was not placed, and what would help.
inline std::string reason_of(survey::status status, std::size_t stems) {
  constexpr const char* more = "a scan nearer to others, or a denser one, is needed";
  switch (status) {
    case survey::status::no_stems:
      return "no stems; " + std::string(more);
    case survey::status::unplaced:
      return stems < 4 ? std::to_string(stems) + " stems, at least 4 are needed; " + more
                       : std::string(
                             "its stems fit those of another scan, but no better than some unrelated "
                             "scan's do; ") +
                             more;
    case survey::status::placed_alone:
      return "its stems fit those of no other scan; " + std::string(more);
    case survey::status::ambiguous:
      return "some of its links place it elsewhere than others do; more overlap is needed to distinguish "
             "them";
    case survey::status::placed:
      break;
  }
  return "";
}

/// The most significant link of each map, whether it is used or not; null where it has none.
inline std::vector<const survey_link*> best_links(const local_survey& s) {
  std::vector<const survey_link*> best(s.maps.size(), nullptr);
  for (const survey_link& l : s.links)
    for (const std::uint32_t m : {l.source, l.target})
      if (!best[m] || l.log10_nfa < best[m]->log10_nfa) best[m] = &l;
  return best;
}

/// The status of a map that no link holds, and a guess where its best link would place it.
inline void describe_unlinked(survey::scan& scan, const local_survey& s, std::size_t map,
                              const survey_link* best) {
  constexpr std::size_t minimum = 4;  // stems
  const std::size_t stems = s.maps[map].stems.size();
  if (stems == 0)
    scan.status = survey::status::no_stems;
  else if (!s.placed.elsewhere[map].empty())
    scan.status = survey::status::ambiguous;
  else
    scan.status = stems < minimum || best ? survey::status::unplaced : survey::status::placed_alone;
  scan.reason = reason_of(scan.status, stems);
  if (!best) return;
  const std::uint32_t other = best->source == map ? best->target : best->source;
  const plan_pose from_map =
      best->source == map ? best->target_from_source : best->target_from_source.inverse();
  const auto guess = [&](const plan_pose& pose) {
    return to_eigen(s.reference_of(other).stems.frame.local_from_scan().inverse() *
                    in_space(pose, s.heights.of_map[other]) * s.maps[map].stems.frame.local_from_scan());
  };
  scan.survey_from_scan = guess(s.adjusted.poses[other] * from_map);
  for (const plan_pose& elsewhere : s.placed.elsewhere[map]) scan.alternatives.push_back(guess(elsewhere));
}

/// Components by decreasing size, then by their lowest map; -1 for those of one map that was not placed.
inline std::vector<int> number_components(const local_survey& s, const std::vector<survey::scan>& scans) {
  std::vector<std::uint32_t> order;
  for (std::uint32_t c = 0; c < s.members.size(); ++c)
    if (s.members[c].size() > 1 || scans[s.members[c][0]].status == survey::status::placed_alone)
      order.push_back(c);
  std::stable_sort(order.begin(), order.end(),
                   [&](auto a, auto b) { return s.members[a].size() > s.members[b].size(); });
  std::vector<int> number(s.members.size(), -1);
  for (std::size_t i = 0; i < order.size(); ++i) number[order[i]] = int(i);
  return number;
}

inline void describe_scans(survey& result, const local_survey& s) {
  result.scans.resize(s.maps.size());
  const std::vector<const survey_link*> best = best_links(s);
  const auto shared = shared_stems(s.maps, s.adjusted.poses, s.adjusted.trees, s.adjusted.weights);
  for (const survey_link& l : s.links)
    if (l.used) ++result.scans[l.source].links, ++result.scans[l.target].links;
  for (std::size_t m = 0; m < s.maps.size(); ++m) {
    survey::scan& scan = result.scans[m];
    if (s.members[s.placed.parts.of[m]].size() < 2) {
      describe_unlinked(scan, s, m, best[m]);
      continue;
    }
    scan.status = survey::status::placed;
    scan.survey_from_scan = s.survey_from_scan(m, s.adjusted.poses[m]);
    scan.uncertainty = uncertainty_of(s, m);
    scan.is_height_known = s.is_height_known(m);
    const split_check check = check_by_halves(shared[m]);
    scan.check_median = check.median;
    scan.check_worst = check.worst;
  }
  const std::vector<int> number = number_components(s, result.scans);
  for (std::size_t m = 0; m < s.maps.size(); ++m) result.scans[m].component = number[s.placed.parts.of[m]];
  result.components = std::size_t(std::count_if(number.begin(), number.end(), [](int n) { return n >= 0; }));
}

inline void describe_links(survey& result, const local_survey& s) {
  for (const survey_link& l : s.links) {
    survey::link link;
    link.source = l.source;
    link.target = l.target;
    std::vector<double> above;
    for (const correspondence& c : l.correspondences)
      above.push_back(s.maps[l.target].stems.at[c.target].z - s.maps[l.source].stems.at[c.source].z);
    link.target_from_source = to_eigen(s.maps[l.target].stems.frame.local_from_scan().inverse() *
                                       in_space(l.target_from_source, median(above)) *
                                       s.maps[l.source].stems.frame.local_from_scan());
    link.log10_nfa = l.log10_nfa;
    link.correspondences = l.correspondences.size();
    link.inlier_threshold = l.inlier_threshold;
    link.rms = l.rms;
    link.supporting_cycles = l.supporting_cycles;
    link.used = l.used;
    if (s.placed.parts.of[l.source] == s.placed.parts.of[l.target])
      link.residual = link_residual(l, s.adjusted.poses[l.source], s.adjusted.poses[l.target]).shift.norm();
    result.links.push_back(link);
  }
}

inline void describe_trees(survey& result, const local_survey& s) {
  const tree_observations& trees = s.adjusted.trees;
  for (std::size_t t = 0; t < trees.size(); ++t) {
    survey::tree tree;
    vec3 sum;
    double total = 0, of_heights = 0;
    std::vector<double> radii;
    for (std::size_t i = trees.first[t]; i < trees.first[t + 1]; ++i) {
      const stem_of_map& o = trees.stems[i];
      const position_set& stems = s.maps[o.map].stems;
      const double weight = s.adjusted.weights[i], weight_of_height = s.heights.weights[i];
      if (!(weight > 0)) continue;
      const vec2 place = s.adjusted.poses[o.map] * stems.at[o.stem].xy();
      sum.x += weight * place.x;
      sum.y += weight * place.y;
      sum.z += weight_of_height * (stems.at[o.stem].z + s.heights.of_map[o.map]);
      total += weight;
      of_heights += weight_of_height;
      if (!stems.radius.empty() && stems.radius[o.stem] > 0) radii.push_back(stems.radius[o.stem]);
      tree.seen.push_back({o.map, stems.original[o.stem]});
    }
    if (tree.seen.empty()) continue;
    const std::uint32_t map = trees.stems[trees.first[t]].map;
    const vec3 place = {sum.x / total, sum.y / total, of_heights > 0 ? sum.z / of_heights : 0};
    tree.position = to_eigen(s.reference_of(map).stems.frame.to_scan(place));
    tree.radius = radii.empty() ? 0 : median(radii);
    tree.sigma = s.adjusted.stem_sigma / std::sqrt(total);
    tree.height_sigma = of_heights > 0 ? s.heights.stem_sigma / std::sqrt(of_heights)
                                       : std::numeric_limits<double>::infinity();
    tree.component = result.scans[map].component;
    result.trees.push_back(std::move(tree));
  }
}

}  // namespace globalmatch::detail

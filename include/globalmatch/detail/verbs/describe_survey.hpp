// What is reported of a survey, in the frames and indices of the caller.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/matching/uncertainty.hpp"
#include "globalmatch/detail/survey/adjust_to_trees.hpp"
#include "globalmatch/detail/survey/guess_places.hpp"
#include "globalmatch/detail/survey/link_graph.hpp"
#include "globalmatch/detail/survey/place_maps.hpp"
#include "globalmatch/detail/survey/place_targets.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/split_check.hpp"
#include "globalmatch/detail/survey/survey_heights.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/detail/survey/survey_targets.hpp"
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
                             "scan's do, or not the trees that others agree on; ") +
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

/// The component of most maps, those of one left out; nothing where all are.
inline std::optional<std::uint32_t> main_component(const local_survey& s) {
  std::optional<std::uint32_t> largest;
  for (std::uint32_t c = 0; c < s.members.size(); ++c)
    if (s.members[c].size() > (largest ? s.members[*largest].size() : 1)) largest = c;
  return largest;
}

/// Where a link to a map that was placed places another one.
inline Eigen::Isometry3d guess_by(const link_graph::edge& e, const link_graph& graph, const local_survey& s,
                                  std::uint32_t map) {
  const survey_link& l = graph.link(e);
  const double raise = raise_of(s.maps, l), above = l.source == map ? -raise : raise;  // the neighbor
  const plan_pose pose = s.adjusted.poses[e.neighbor] * graph.neighbor_from(map, e);
  return to_eigen(s.reference_of(e.neighbor).stems.frame.local_from_scan().inverse() *
                  in_space(pose, s.heights.of_map[e.neighbor] - above) *
                  s.maps[map].stems.frame.local_from_scan());
}

/// The status of a map that no link holds, and guesses where its links, of `all`, would place it in `main`.
inline void describe_unlinked(survey::scan& scan, const local_survey& s, std::uint32_t map,
                              const link_graph& all, std::optional<std::uint32_t> main) {
  constexpr std::size_t minimum = 4;  // stems
  const std::size_t stems = s.maps[map].stems.size();
  const bool is_ambiguous = s.placed.ambiguous[map] != 0;
  if (stems == 0)
    scan.status = survey::status::no_stems;
  else if (is_ambiguous)
    scan.status = survey::status::ambiguous;
  else
    scan.status =
        stems < minimum || !all.of(map).empty() ? survey::status::unplaced : survey::status::placed_alone;
  const auto by_targets = [&](const link_graph::edge& e) { return all.link(e).is_of_targets(); };
  scan.reason =
      is_ambiguous && std::any_of(all.of(map).begin(), all.of(map).end(), by_targets)
          ? "its targets place it elsewhere than its stems or other targets do; they must be in the "
            "frame of the scan, each name for one point"
          : reason_of(scan.status, stems);
  const auto guesses = guess_places(map, all, s.adjusted.poses, [&](const link_graph::edge& e) {
    return main && s.placed.parts.of[e.neighbor] == *main && (!is_ambiguous || s.placed.tried[e.link]);
  });
  if (guesses.empty()) return;
  scan.survey_from_scan = guess_by(guesses[0], all, s, map);
  for (std::size_t i = 1; i < guesses.size() && is_ambiguous; ++i)
    scan.alternatives.push_back(guess_by(guesses[i], all, s, map));
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
  const link_graph all(s.maps.size(), s.links, [](const survey_link&) { return true; });
  const auto main = main_component(s);
  const auto shared = shared_stems(s.maps, s.adjusted.poses, s.adjusted.trees, s.adjusted.weights);
  for (const survey_link& l : s.links)
    if (l.used) ++result.scans[l.source].links, ++result.scans[l.target].links;
  for (std::uint32_t m = 0; m < s.maps.size(); ++m) {
    survey::scan& scan = result.scans[m];
    if (s.members[s.placed.parts.of[m]].size() < 2) {
      describe_unlinked(scan, s, m, all, main);
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

/// Root mean square [m] in plan of how far the adjusted poses place paired stems from where the link does; of
/// a link by targets how far their centroid.
inline double residual_of(const survey_link& l, const local_survey& s) {
  if (l.is_of_targets())
    return link_residual(l, s.adjusted.poses[l.source], s.adjusted.poses[l.target]).shift.norm();
  const plan_pose target_from_source = s.adjusted.poses[l.target].inverse() * s.adjusted.poses[l.source];
  double squares = 0;
  for (const correspondence& c : l.correspondences) {
    const vec2 stem = s.maps[l.source].stems.at[c.source].xy();
    squares += (target_from_source * stem - l.target_from_source * stem).squared_norm();
  }
  return std::sqrt(squares / double(std::max<std::size_t>(1, l.correspondences.size())));
}

/// Median distance [m] by which a link fails to close the cycles of three that are used; not a number where
/// there are none.
inline double closure_of(const survey_link& l, const link_graph& used) {
  std::vector<double> distances;
  used.for_each_common_neighbor(l.source, l.target, [&](const auto& of_source, const auto& of_target) {
    distances.push_back(cycle_closure(used, l, of_source, of_target).distance());
  });
  return median(distances);
}

inline void describe_links(survey& result, const local_survey& s) {
  const link_graph used(s.maps.size(), s.links, [](const survey_link& l) { return l.used; });
  for (const survey_link& l : s.links) {
    survey::link link;
    link.source = l.source;
    link.target = l.target;
    link.target_from_source = to_eigen(s.maps[l.target].stems.frame.local_from_scan().inverse() *
                                       in_space(l.target_from_source, raise_of(s.maps, l)) *
                                       s.maps[l.source].stems.frame.local_from_scan());
    link.log10_nfa = l.log10_nfa;
    link.correspondences = l.correspondences.size();
    link.targets = l.targets.size();
    link.inlier_threshold = l.inlier_threshold;
    link.rms = l.rms;
    link.sigma_plan = std::sqrt((l.covariance(0, 0) + l.covariance(1, 1)) / 2);
    link.sigma_yaw = std::sqrt(l.covariance(2, 2));
    link.closure = closure_of(l, used);
    link.supporting_cycles = l.supporting_cycles;
    link.used = l.used;
    if (s.placed.parts.of[l.source] == s.placed.parts.of[l.target]) link.residual = residual_of(l, s);
    result.links.push_back(link);
  }
  std::sort(result.links.begin(), result.links.end(), [](const auto& a, const auto& b) {
    return std::tuple(a.source, a.target, a.targets) < std::tuple(b.source, b.target, b.targets);
  });
}

/// Variance [m^2] in plan, along each axis, of where the pose of a map places this.
inline double pose_variance(const local_survey& s, std::uint32_t map, const vec2& place) {
  const vec2 lever = quarter_turned(place - s.adjusted.poses[map].shift);
  const mat3& c = s.adjusted.covariance[map];
  return (c(0, 0) + c(1, 1) + c(2, 2) * lever.squared_norm() + 2 * (c(0, 2) * lever.x + c(1, 2) * lever.y)) /
         2;
}

/// What the observations of a tree say, weighted.
struct tree_sums {
  vec3 place;  ///< [m] with heights weighted by themselves
  double weight = 0, height_weight = 0;
  double variance = 0, height_variance = 0;  ///< [m^2] of the poses
  std::vector<double> radii;
  std::vector<survey::observation> seen;

  void add(const local_survey& s, std::size_t i, const vec2& at) {
    const stem_of_map& o = s.adjusted.trees.stems[i];
    const position_set& stems = s.maps[o.map].stems;
    const double w = s.adjusted.weights[i], w_height = s.heights.weights[i];
    if (!(w > 0)) return;
    place += {w * at.x, w * at.y, w_height * (stems.at[o.stem].z + s.heights.of_map[o.map])};
    weight += w;
    height_weight += w_height;
    variance += w * pose_variance(s, o.map, at);
    height_variance += w_height * s.heights.sigma[o.map] * s.heights.sigma[o.map];
    if (!stems.radius.empty() && stems.radius[o.stem] > 0) radii.push_back(stems.radius[o.stem]);
    seen.push_back({o.map, stems.original[o.stem], w, w_height});
  }
};

inline void describe_trees(survey& result, const local_survey& s) {
  const tree_observations& trees = s.adjusted.trees;
  const std::vector<vec2> placed = placed_stems(s.maps, trees, s.adjusted.poses);
  result.stem_sigma = s.adjusted.stem_sigma;
  for (std::size_t t = 0; t < trees.size(); ++t) {
    tree_sums sums;
    for (std::size_t i = trees.first[t]; i < trees.first[t + 1]; ++i) sums.add(s, i, placed[i]);
    if (sums.seen.empty()) continue;
    const double weight = sums.weight, height_weight = sums.height_weight;
    const bool has_height = height_weight > 0;
    const std::uint32_t map = trees.stems[trees.first[t]].map;
    const vec3 place = {sums.place.x / weight, sums.place.y / weight,
                        has_height ? sums.place.z / height_weight : 0};
    survey::tree tree;
    tree.position = to_eigen(s.reference_of(map).stems.frame.to_scan(place));
    tree.radius = sums.radii.empty() ? 0 : median(sums.radii);
    // Errors of poses are taken for common to the maps that saw it, as those of neighbors nearly are.
    tree.sigma = std::sqrt((s.adjusted.stem_sigma * s.adjusted.stem_sigma + sums.variance) / weight);
    tree.height_sigma =
        has_height
            ? std::sqrt((s.heights.stem_sigma * s.heights.stem_sigma + sums.height_variance) / height_weight)
            : std::numeric_limits<double>::infinity();
    tree.component = result.scans[map].component;
    tree.seen = std::move(sums.seen);
    result.trees.push_back(std::move(tree));
  }
}

/// The targets of scans that have a component, with what they count in the adjustments.
inline void describe_targets(survey& result, const local_survey& s,
                             std::span<const survey_options::target> given) {
  const target_observations& targets = s.adjusted.targets;
  for (std::size_t t = 0; t < targets.size(); ++t) {
    survey::target target;
    for (std::size_t i = targets.first[t]; i < targets.first[t + 1]; ++i) {
      const target_of_map& o = targets.seen[i];
      target.name = given[o.given].name;
      target.component = result.scans[o.map].component;
      target.seen.push_back({o.map, given[o.given].position, given[o.given].sigma,
                             s.adjusted.target_weights[i], s.heights.target_weights[i]});
    }
    if (target.component >= 0) result.targets.push_back(std::move(target));
  }
  std::stable_sort(result.targets.begin(), result.targets.end(), [](const auto& a, const auto& b) {
    return std::tie(a.name, a.component) < std::tie(b.name, b.component);
  });
  place_targets(result);
}

}  // namespace globalmatch::detail

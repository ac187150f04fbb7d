// Likely causes why two maps do not match: what is usually wrong with coordinates. In: two maps that were not
// registered, or hardly. Out: what to tell the user.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/detail/matching/null_model.hpp"
#include "globalmatch/detail/matching/position_evidence.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/matching/vote_search.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// Stems in the middle of a map, at most `count`; of what is known of them only where they stand.
inline position_set central_stems(const position_set& stems, std::size_t count) {
  vec3 middle;
  for (const vec3& p : stems.at) middle += p / double(stems.size());
  std::vector<keyed> order;
  for (std::size_t i = 0; i < stems.size(); ++i)
    order.push_back({key_of((stems.at[i] - middle).xy().norm()), i});
  keep_first(order, std::min(count, stems.size()));
  position_set central;
  central.cell_area = stems.cell_area;
  for (const keyed& next : order) central.at.push_back(stems.at[next.value]);
  return central;
}

/// The best hypothesis of votes, in plan: they find what is plain to see. No pairs where nothing is.
inline local_hypothesis match_at_sight(const position_set& source, const prepared_stems& target,
                                       const execution& exec) {
  constexpr double thresholds[] = {0.1, 0.2};  // [m] of proposals
  const matching_context context(source, target.stems, std::make_shared<position_index>(source, exec),
                                 target.index, true, degrees_of_freedom::four, exec);
  null_model null(context, target.background, pairing_thresholds, thresholds);
  null.include_reversed();
  matching_funnel funnel;
  local_hypothesis best;
  for (const double inlier_threshold : thresholds) {
    std::vector<local_hypothesis> found = match_by_votes(context, target.triangles, inlier_threshold, null,
                                                         pairing_thresholds, vote_neighbors, funnel);
    if (!found.empty() && (best.correspondences.empty() || ranks_before(found.front(), best)))
      best = std::move(found.front());
    if (best.log10_nfa < sufficient_log10_nfa) break;
  }
  return best;
}

/// What stems are multiplied by so that their unit is that of another map, and what it is said to be.
struct unit_factor {
  double factor;
  const char* unit;
};

/// Distance [m] of stems from their nearest neighbours, the median of some, in a map of any unit.
inline double spacing_of(const position_set& stems) {
  constexpr std::size_t enough = 64;
  const std::size_t step = (stems.size() + enough - 1) / enough;
  std::vector<double> nearest;
  for (std::size_t i = 0; i < stems.size() && stems.size() > 1; i += step) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t j = 0; j < stems.size(); ++j)
      if (j != i) least = std::min(least, (stems.at[j] - stems.at[i]).xy().squared_norm());
    nearest.push_back(std::sqrt(least));
  }
  return nearest.empty() ? 0 : median(nearest);
}

/// The unit that coordinates seem to have instead of metres, by how far apart the stems of a map stand, and
/// those of another one, which tells more where that seems to be in metres; empty where metres are plausible.
/// Trees stand decimetres to decametres apart.
inline std::string unit_by_spacing(double spacing, double other = 0) {
  constexpr double min_spacing = 0.02, max_spacing = 60, min_millimetres = 600;  // [m]
  constexpr double between_factors = 316;  // that of centimetres and that of millimetres
  if (spacing == 0 || (spacing >= min_spacing && spacing <= max_spacing)) return {};
  if (spacing < min_spacing) return "degrees (of longitude and latitude)";
  const bool other_tells = other >= min_spacing && other <= max_spacing;
  return spacing > (other_tells ? between_factors * other : min_millimetres) ? "millimetres" : "centimetres";
}

inline std::string describe_wrong_unit(const position_set& stems, const position_set& other,
                                       const char* name) {
  constexpr std::size_t min_stems = 4;
  if (stems.size() < min_stems) return {};
  const double spacing = spacing_of(stems);
  const std::string unit = unit_by_spacing(spacing, other.size() < min_stems ? 0 : spacing_of(other));
  if (unit.empty()) return {};
  return std::string(name) + ": the stems stand some " + std::to_string(spacing) +
         " apart: are the coordinates " + unit + "? They must be metres";
}

/// log10 of the NFA of a result, at most that of what is no evidence.
inline double log10_nfa_of(const matching& result) {
  return result.hypotheses.empty() ? 0 : std::min(0.0, result.hypotheses.front().log10_nfa);
}

/// Whether what was found otherwise, say of a changed map, is significant beyond doubt, and more than what
/// was found at first. Both are log10 of an NFA.
inline bool explains_better(double otherwise, double first) {
  constexpr double max_log10_nfa = -6;
  return otherwise < std::min(max_log10_nfa, 2 * first);
}

/// The most likely cause why two maps do not match, and its remedy; empty where none is known. `log10_nfa` is
/// that of the best hypothesis. Cost: as much as matching maps that share many stems, and again for each
/// cause.
inline std::string describe_likely_cause(const position_set& source, position_set target, double log10_nfa,
                                         const execution& exec) {
  constexpr std::size_t min_stems = 8, max_queried = 60, max_indexed = 20000;
  if (std::min(source.size(), target.size()) < min_stems || target.size() > max_indexed) return {};
  const double ratio = spacing_of(target) / spacing_of(source);
  const position_set central = central_stems(source, max_queried);
  const prepared_stems prepared = prepare_stems(std::move(target), true, exec, 0, false);

  position_set mirrored = central;
  for (vec3& p : mirrored.at) p.y = -p.y;
  if (const auto h = match_at_sight(mirrored, prepared, exec); explains_better(h.log10_nfa, log10_nfa))
    return "matching: the mirror image of source fits " + std::to_string(h.correspondences.size()) +
           " stems: are x and y of one map swapped?";

  constexpr unit_factor units[] = {{0.3048, "source in feet and target in metres"},
                                   {1 / 0.3048, "source in metres and target in feet"},
                                   {0.01, "source in centimetres and target in metres"},
                                   {100, "source in metres and target in centimetres"},
                                   {0.001, "source in millimetres and target in metres"},
                                   {1000, "source in metres and target in millimetres"}};
  for (const unit_factor& u : units) {
    constexpr double max_off = 2;  // of maps that show different parts of a stand
    if (std::max(ratio / u.factor, u.factor / ratio) > max_off) continue;
    position_set scaled = central;
    for (vec3& p : scaled.at) p = u.factor * p;
    scaled.cell_area *= u.factor * u.factor;
    if (const auto h = match_at_sight(scaled, prepared, exec); explains_better(h.log10_nfa, log10_nfa))
      return "matching: with source " + std::to_string(u.factor) + " times as large " +
             std::to_string(h.correspondences.size()) + " stems fit: is " + u.unit + "?";
  }
  return {};
}

/// Whether a registration rests on so little that another explanation must be looked for.
inline bool is_doubtful(const matching& result) {
  constexpr double min_doubtful = -15;  // log10 NFA
  return result.outcome == outcome::not_registered ||
         (result.outcome == outcome::registered && result.hypotheses.front().log10_nfa > min_doubtful);
}

/// Says what is likely to be wrong with maps that do not match, or that match less well than the mirror image
/// of one does: these are not registered.
inline matching with_likely_cause(matching&& result, const position_set& source, const position_set& target,
                                  const execution& exec) {
  if (!is_doubtful(result)) return std::move(result);
  std::string cause;
  if (result.outcome == outcome::not_registered) {
    cause = describe_wrong_unit(source, target, "source");
    if (cause.empty()) cause = describe_wrong_unit(target, source, "target");
  }
  if (cause.empty()) cause = describe_likely_cause(source, target, log10_nfa_of(result), exec);
  if (cause.empty()) return std::move(result);
  result.outcome = outcome::not_registered;
  result.reason = std::move(cause);
  result.probability = 0;
  result.target_from_source.reset();
  result.uncertainty.reset();
  result.vertical.reset();
  return std::move(result);
}

}  // namespace globalmatch::detail

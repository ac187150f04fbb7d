// Two maps about to be matched, and what is asked of them over and over: pairs, fits, residuals.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/position_index.hpp"
#include "globalmatch/detail/core/rigid_fit.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/prior.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// Sorts correspondences by source, then by target.
inline void sort_correspondences(std::vector<correspondence>& pairs) {
  std::vector<keyed> order;
  order.reserve(pairs.size());
  for (const correspondence& c : pairs) order.push_back({key_of(c.source, c.target), 0});
  sort_keyed(order);
  for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i] = {first_of(order[i].key), second_of(order[i].key)};
}

/// How work runs where the caller did not say.
inline const execution& default_execution() {
  static const execution exec;
  return exec;
}

/// Refers to both maps and to `exec`.
///
/// In 6-DoF distances of stems are those in space. In 4-DoF they are horizontal: heights are the noisier
/// coordinate ([GM] 5.4.3), and what is wrong with them is decided when the stems are paired
/// (`vertical_fit`).
class matching_context {
 public:
  matching_context(const position_set& source_stems, const position_set& target_stems, bool ignore_heights,
                   degrees_of_freedom freedom)
      : matching_context(source_stems, target_stems, std::make_shared<position_index>(source_stems),
                         std::make_shared<position_index>(target_stems), ignore_heights, freedom) {}

  /// The indices are those of both maps.
  matching_context(const position_set& source_stems, const position_set& target_stems,
                   std::shared_ptr<const position_index> index_of_source,
                   std::shared_ptr<const position_index> index_of_target, bool ignore_heights,
                   degrees_of_freedom freedom, const execution& run_by = default_execution(),
                   std::optional<local_prior> known_before = {})
      : source(source_stems),
        target(target_stems),
        horizontal(ignore_heights),
        dof(freedom),
        source_index(std::move(index_of_source)),
        target_index(std::move(index_of_target)),
        exec(run_by),
        prior(std::move(known_before)) {}

  /// The same maps the other way round.
  matching_context reversed() const {
    return {target,     source, target_index, source_index,
            horizontal, dof,    exec,         prior ? std::optional(prior->reversed()) : std::nullopt};
  }

  const position_set &source, &target;
  const bool horizontal;  ///< edges of the triangles of `algorithm_1` are horizontal; in 4-DoF only
  const degrees_of_freedom dof;
  const std::shared_ptr<const position_index> source_index, target_index;
  const execution& exec;
  const std::optional<local_prior> prior;

  /// Whether the prior, if any, allows a transform.
  bool allows(const rigid& target_from_source) const { return !prior || prior->allows(target_from_source); }

  /// Whether distances are horizontal.
  bool horizontal_distances() const { return dof == degrees_of_freedom::four; }

  /// Calls `visit(target stem, distance)` for the target stems nearer than `inlier_threshold` [m] to a
  /// transformed source stem.
  template <class Visit>
  void for_each_inlier(const vec3& transformed, double inlier_threshold, const Visit& visit) const {
    const auto check = [&](stem_index t, double squared) {
      if (!horizontal_distances()) {
        squared = (transformed - target.at[t]).squared_norm();
        if (squared >= inlier_threshold * inlier_threshold) return;
      }
      visit(t, std::sqrt(squared));
    };
    target_index->for_each_within(transformed.x, transformed.y, inlier_threshold, check);
  }

  /// Whether there is one.
  bool has_inlier(const vec3& transformed, double inlier_threshold) const {
    bool found = false;
    for_each_inlier(transformed, inlier_threshold, [&](stem_index, double) { found = true; });
    return found;
  }

  /// Calls `visit(source stem)` for those nearer to `center` than `radius` [m horizontal], which may be
  /// infinite.
  template <class Visit>
  void for_each_source_within(const vec3& center, double radius, const Visit& visit) const {
    if (std::isfinite(radius))
      source_index->for_each_within(center.x, center.y, radius, [&](stem_index s, double) { visit(s); });
    else
      for (stem_index s = 0; s < source.size(); ++s) visit(s);
  }

  /// Pairs transformed source stems with target stems, nearest first, one to one, within `inlier_threshold`
  /// [m]; of each source stem the nearest ones are candidates, so that memory is linear where stems lie on
  /// top of each other. Only source stems nearer to `center` than `radius` [m horizontal] are looked at.
  std::vector<correspondence> pair_stems(const rigid& target_from_source, double inlier_threshold,
                                         const vec3& center = {},
                                         double radius = std::numeric_limits<double>::infinity()) const {
    constexpr std::size_t max_candidates = 16;  // of a stem; trees do not stand so close
    std::vector<keyed> candidates, of_stem;
    std::size_t visited = 0;
    for_each_source_within(center, radius, [&](stem_index s) {
      poll_cancelled_at(visited++);
      of_stem.clear();
      for_each_inlier(target_from_source * source.at[s], inlier_threshold,
                      [&](stem_index t, double distance) {
                        of_stem.push_back({key_of(distance), key_of(s, t)});
                      });
      if (of_stem.size() > max_candidates) keep_first(of_stem, max_candidates);
      candidates.insert(candidates.end(), of_stem.begin(), of_stem.end());
    });
    sort_keyed(candidates);
    return take_one_to_one(candidates);
  }

  /// Least squares transform over the correspondences, all equal or with `weights`; in 4-DoF its height is
  /// the median of what they ask for.
  std::optional<rigid> fit(std::span<const correspondence> pairs,
                           std::span<const double> weights = {}) const {
    constexpr std::size_t few = 3;  // of the triangles, by the million
    if (pairs.size() <= few) {
      vec3 from[few], to[few];
      double offsets[few];
      return fit(pairs, weights, from, to, offsets);
    }
    std::vector<vec3> from(pairs.size()), to(pairs.size());
    std::vector<double> offsets(pairs.size());
    return fit(pairs, weights, from.data(), to.data(), offsets.data());
  }

  /// At the `i`-th of many steps: polls now and then.
  static void poll_cancelled_at(std::size_t i) {
    constexpr std::size_t between_polls = 512;  // stems
    if (i % between_polls == between_polls - 1) poll_cancelled();
  }

  /// Distance [m] of two paired stems.
  double residual(const rigid& target_from_source, const correspondence& c) const {
    return stem_distance(target_from_source * source.at[c.source], target.at[c.target],
                         horizontal_distances());
  }
  std::vector<double> residuals(const rigid& target_from_source,
                                std::span<const correspondence> pairs) const {
    std::vector<double> result;
    result.reserve(pairs.size());
    for (const correspondence& c : pairs) result.push_back(residual(target_from_source, c));
    return result;
  }

  /// Root mean square distance [m] of paired stems.
  double rms(const rigid& target_from_source, std::span<const correspondence> pairs) const {
    double squares = 0;
    for (const double r : residuals(target_from_source, pairs)) squares += r * r;
    return pairs.empty() ? 0 : std::sqrt(squares / double(pairs.size()));
  }

  /// Distance [m] between where two transforms place a source stem.
  double displacement(const rigid& a, const rigid& b, stem_index s) const {
    return stem_distance(a * source.at[s], b * source.at[s], horizontal_distances());
  }

 private:
  /// Each stem goes with the first candidate that has it.
  std::vector<correspondence> take_one_to_one(std::vector<keyed>& candidates) const {
    std::vector<bool> source_taken(source.size()), target_taken(target.size());
    std::size_t taken = 0;
    for (const keyed& candidate : candidates) {
      const stem_index s = first_of(candidate.value), t = second_of(candidate.value);
      if (source_taken[s] || target_taken[t]) continue;
      source_taken[s] = target_taken[t] = true;
      candidates[taken++] = {candidate.value, 0};
    }
    candidates.resize(taken);
    sort_keyed(candidates);
    std::vector<correspondence> pairs;
    pairs.reserve(taken);
    for (const keyed& pair : candidates) pairs.push_back({first_of(pair.key), second_of(pair.key)});
    return pairs;
  }

  std::optional<rigid> fit(std::span<const correspondence> pairs, std::span<const double> weights, vec3* from,
                           vec3* to, double* vertical_offsets) const {
    const std::size_t size = pairs.size();
    for (std::size_t i = 0; i < size; ++i) {
      from[i] = source.at[pairs[i].source];
      to[i] = target.at[pairs[i].target];
      vertical_offsets[i] = to[i].z - from[i].z;
    }
    auto transform = fit_rigid({from, size}, {to, size}, dof, weights);
    if (transform && dof == degrees_of_freedom::four)
      transform->translation.z = median({vertical_offsets, size});
    return transform;
  }
};

}  // namespace globalmatch::detail

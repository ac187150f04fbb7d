// Hypotheses: a motion with the stems it pairs. Verified over all stems, ranked, and told apart.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/position_index.hpp"
#include "globalmatch/detail/core/sort_stably.hpp"
#include "globalmatch/detail/core/rigid_fit.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/stem_map.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// A hypothesis in the levelled local frames; see `globalmatch::hypothesis`.
struct local_hypothesis {
  std::vector<correspondence> correspondences;  ///< one to one, increasing
  rigid target_from_source;
  double inlier_threshold = 0;   ///< [m] stems this near each other were paired
  double log10_nfa = 0;          ///< see `null_model.hpp`
  double log10_nfa_poisson = 0;  ///< the same if stems stood at random
  evidence_source evidence = evidence_source::stems;
  double rms = 0;             ///< [m] distance of paired stems
  std::size_t consensus = 0;  ///< triangle pairs in its consensus set
};

/// What one kind of evidence makes of a transform.
struct evidence_score {
  double log10_nfa = 0;  ///< motions that would do as well by chance
  evidence_source evidence = evidence_source::stems;
};

/// Less explainable by chance first, then more paired stems, then nearer ones, then larger consensus sets.
inline bool ranks_before(const local_hypothesis& a, const local_hypothesis& b) {
  const auto merit = [](const local_hypothesis& h) {
    return std::tuple(-h.log10_nfa, h.correspondences.size(), -h.rms, h.consensus);
  };
  return merit(a) > merit(b);
}

/// Ranks hypotheses, the best first; equal ones keep their order.
inline void rank(std::vector<local_hypothesis>& hypotheses) {
  sort_stably(hypotheses, ranks_before);
}

/// Ranks hypotheses and forgets all but the `maximum` best.
inline void keep_best(std::vector<local_hypothesis>& hypotheses, std::size_t maximum) {
  rank(hypotheses);
  if (hypotheses.size() > maximum)
    hypotheses.erase(hypotheses.begin() + std::ptrdiff_t(maximum), hypotheses.end());
}

/// Two maps about to be matched, with what verification needs over and over. Refers to both.
///
/// Stems meet in space in 6-DoF. In 4-DoF they meet in plan, and their heights, the noisier coordinate ([GM]
/// 5.4.3), only tell which of them cannot be one stem.
class matching_context {
 public:
  matching_context(const position_set& from, const position_set& onto, bool ignore_heights,
                   degrees_of_freedom freedom, double height_threshold = 1)
      : matching_context(from, onto, std::make_shared<position_index>(from),
                         std::make_shared<position_index>(onto), ignore_heights, freedom, height_threshold) {}

  /// `from_index` and `onto_index` are those of `from` and of `onto`.
  matching_context(const position_set& from, const position_set& onto,
                   std::shared_ptr<const position_index> from_index,
                   std::shared_ptr<const position_index> onto_index, bool ignore_heights,
                   degrees_of_freedom freedom, double height_threshold = 1)
      : source(from),
        target(onto),
        horizontal(ignore_heights),
        dof(freedom),
        vertical_threshold(height_threshold),
        source_index(std::move(from_index)),
        target_index(std::move(onto_index)) {}

  /// The same maps the other way round.
  matching_context reversed() const {
    matching_context context(target, source, target_index, source_index, horizontal, dof, vertical_threshold);
    context.on_poll = on_poll;
    return context;
  }

  const position_set &source, &target;
  const bool horizontal;  ///< heights tell nothing but that of the motion; in 4-DoF only
  const degrees_of_freedom dof;
  const double vertical_threshold;  ///< [m] in 4-DoF: heights of one stem in both maps differ by less
  const std::shared_ptr<const position_index> source_index, target_index;
  /// Called now and then by what looks at all stems, so that it can be cancelled; may throw, and may be
  /// empty.
  std::function<void()> on_poll;

  /// Whether distances are those in plan.
  bool horizontal_distances() const { return dof == degrees_of_freedom::four; }

  /// Whether heights tell, apart from distances, which stems cannot be one.
  bool uses_heights() const { return horizontal_distances() && !horizontal; }
  /// Whether the heights allow that a laid source stem is this target stem.
  bool heights_agree(const vec3& transformed, stem_index t) const {
    return !uses_heights() || std::abs(transformed.z - target.at[t].z) < vertical_threshold;
  }

  /// Calls `visit(target stem, distance)` for the target stems nearer than `inlier_threshold` [m] to a
  /// position.
  template <class Visit>
  void for_each_inlier(const vec3& transformed, double inlier_threshold,
                       const Visit& visit) const {
    target_index->for_each_within(transformed.x, transformed.y, inlier_threshold,
                                  [&](stem_index t, double squared) {
                                    if (!horizontal_distances()) {
                                      squared = (transformed - target.at[t]).squared_norm();
                                      if (squared >= inlier_threshold * inlier_threshold) return;
                                    }
                                    if (heights_agree(transformed, t)) visit(t, std::sqrt(squared));
                                  });
  }

  /// Calls `visit(source stem)` for those nearer to `center` than `radius` [m in plan], which may be
  /// infinite.
  template <class Visit>
  void for_each_source_within(const vec3& center, double radius, const Visit& visit) const {
    if (std::isfinite(radius))
      source_index->for_each_within(center.x, center.y, radius, [&](stem_index s, double) { visit(s); });
    else
      for (stem_index s = 0; s < source.size(); ++s) visit(s);
  }

  /// Pairs source stems with the target stems they are laid on, nearest first, one to one, within
  /// `inlier_threshold` [m]. Only source stems nearer to `center` than `radius` [m in plan] are looked at.
  std::vector<correspondence> pair_stems(const rigid& target_from_source, double inlier_threshold,
                                         const vec3& center = vec3{},
                                         double radius = std::numeric_limits<double>::infinity()) const {
    std::vector<std::pair<double, correspondence>> candidates;
    std::size_t visited = 0;
    for_each_source_within(center, radius, [&](stem_index s) {
      poll_cancelled_at(visited++);
      for_each_inlier(target_from_source * source.at[s], inlier_threshold,
                      [&](stem_index t, double distance) {
                        candidates.push_back({distance, {s, t}});
                      });
    });
    if (visited >= poll_interval) poll_cancelled();
    std::sort(candidates.begin(), candidates.end());
    if (visited >= poll_interval) poll_cancelled();
    std::vector<bool> source_taken(source.size()), target_taken(target.size());
    std::vector<correspondence> pairs;
    for (const auto& entry : candidates) {
      const correspondence& c = entry.second;
      if (source_taken[c.source] || target_taken[c.target]) continue;
      source_taken[c.source] = target_taken[c.target] = true;
      pairs.push_back(c);
    }
    std::sort(pairs.begin(), pairs.end());
    return pairs;
  }

  /// Least squares motion over the correspondences, all equal or with `weights`; in 4-DoF its height is the
  /// median of what they ask for.
  std::optional<rigid> fit(std::span<const correspondence> pairs,
                                       std::span<const double> weights = {}) const {
    constexpr std::size_t few = 3;  // of the triangles, by the million
    if (pairs.size() <= few) {
      std::array<vec3, few> from, to;
      std::array<double, few> vertical_offsets;
      const auto used = [&](auto& all) { return std::span(all).first(pairs.size()); };
      return fit(pairs, weights, used(from), used(to), used(vertical_offsets));
    }
    std::vector<vec3> from(pairs.size()), to(pairs.size());
    std::vector<double> vertical_offsets(pairs.size());
    return fit(pairs, weights, from, to, vertical_offsets);
  }

  void poll_cancelled() const {
    if (on_poll) on_poll();
  }
  /// At the `i`-th of many steps: now and then.
  void poll_cancelled_at(std::size_t i) const {
    if (i % poll_interval == poll_interval - 1) poll_cancelled();
  }

  /// Distance [m] of two paired stems.
  double residual(const rigid& target_from_source, const correspondence& c) const {
    return stem_distance(target_from_source * source.at[c.source], target.at[c.target],
                         horizontal_distances());
  }

  /// Root mean square distance [m] of paired stems.
  double rms(const rigid& target_from_source, std::span<const correspondence> pairs) const {
    double squares = 0;
    for (const correspondence& c : pairs) squares += std::pow(residual(target_from_source, c), 2);
    return pairs.empty() ? 0 : std::sqrt(squares / double(pairs.size()));
  }

 private:
  static constexpr std::size_t poll_interval = 16384;  // stems

  std::optional<rigid> fit(std::span<const correspondence> pairs, std::span<const double> weights,
                                       std::span<vec3> from, std::span<vec3> to,
                                       std::span<double> vertical_offsets) const {
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      from[i] = source.at[pairs[i].source];
      to[i] = target.at[pairs[i].target];
      vertical_offsets[i] = to[i].z - from[i].z;
    }
    auto transform = fit_rigid(from, to, dof, weights);
    if (transform && dof == degrees_of_freedom::four) transform->translation.z = median(vertical_offsets);
    return transform;
  }
};

/// Drops the correspondence that fits worst until all lie within `inlier_threshold` [m] of each other.
inline std::vector<correspondence> drop_outliers(const matching_context& context,
                                                 std::span<const correspondence> start,
                                                 double inlier_threshold) {
  std::vector<correspondence> pairs(start.begin(), start.end());
  while (const auto transform = context.fit(pairs)) {
    const auto worst =
        std::max_element(pairs.begin(), pairs.end(), [&](const correspondence& a, const correspondence& b) {
          return context.residual(*transform, a) < context.residual(*transform, b);
        });
    if (context.residual(*transform, *worst) < inlier_threshold) break;
    pairs.erase(worst);
  }
  return pairs;
}

/// How far [m] two motions lay what is within `radius` of `center` apart, at most.
inline double displacement(const rigid& a, const rigid& b,
                           const vec3& center, double radius) {
  const double turn = rotation_angle(transpose_times(a.rotation, b.rotation));
  return (a * center - b * center).norm() + turn * radius;
}

/// Pairs all stems under the motion that most of `start` agree on, and fits it anew until the pairs stand. A
/// motion from a few stems is only good near them: pairing begins there and grows outwards, as long as
/// `is_promising(target_from_source, center, radius)`. Nothing when it is not, or when fewer than three pairs
/// are left.
template <class IsPromising>
std::optional<local_hypothesis> verify(const matching_context& context, std::span<const correspondence> start,
                                 double inlier_threshold, const IsPromising& is_promising) {
  constexpr int max_iterations = 20, max_interim_iterations = 3;
  constexpr double relative_convergence_threshold = 0.01;  // of the tolerance
  std::vector<correspondence> pairs = drop_outliers(context, start, inlier_threshold);
  if (pairs.empty()) return std::nullopt;
  vec3 center = vec3{};
  for (const correspondence& c : pairs) center += context.source.at[c.source] / double(pairs.size());
  const auto distance = [&](const vec3& p) { return (p - center).xy().norm(); };
  double started = 0, whole = 0;
  for (const correspondence& c : pairs) started = std::max(started, distance(context.source.at[c.source]));
  for (const vec3& p : context.source.at) whole = std::max(whole, distance(p));

  local_hypothesis h;
  h.inlier_threshold = inlier_threshold;
  for (double radius = std::max(2 * started, 20 * inlier_threshold);; radius *= 2) {
    const bool last = radius >= whole;
    for (int iteration = 0; iteration < (last ? max_iterations : max_interim_iterations); ++iteration) {
      const auto transform = context.fit(pairs);
      if (!transform) return std::nullopt;
      const bool converged = displacement(*transform, h.target_from_source, center, std::min(radius, whole)) <
                             relative_convergence_threshold * inlier_threshold;
      h.target_from_source = *transform;
      h.correspondences = last ? context.pair_stems(*transform, inlier_threshold)
                               : context.pair_stems(*transform, inlier_threshold, center, radius);
      if (converged || h.correspondences == pairs) break;
      pairs = h.correspondences;
    }
    if (last) break;
    if (!is_promising(std::as_const(h.target_from_source), std::as_const(center), radius))
      return std::nullopt;
    pairs = h.correspondences;
  }
  if (h.correspondences.size() < 3) return std::nullopt;
  h.rms = context.rms(h.target_from_source, h.correspondences);
  return h;
}

/// The same for hypotheses that are promising whatever they look like around the start.
inline std::optional<local_hypothesis> verify(const matching_context& context,
                                        std::span<const correspondence> start, double inlier_threshold) {
  return verify(context, start, inlier_threshold, [](const auto&...) { return true; });
}

/// Whether two hypotheses lay the source stems paired by either at places that differ by more than `distance`
/// [m] on average: they then are rivals and not two views of one motion.
inline bool differ(const local_hypothesis& a, const local_hypothesis& b, const matching_context& context,
                   double distance) {
  double sum = 0;
  std::size_t count = 0;
  for (const local_hypothesis* h : {&a, &b})
    for (const correspondence& c : h->correspondences) {
      const vec3& p = context.source.at[c.source];
      sum +=
          stem_distance(a.target_from_source * p, b.target_from_source * p, context.horizontal_distances());
      ++count;
    }
  return count == 0 || sum > distance * double(count);
}

/// Whether a triangle's motion would lead to a known hypothesis again: two correspondences fix a motion, so
/// two shared ones that do not stand together are enough.
inline bool leads_to(const std::array<correspondence, 3>& triangle, const local_hypothesis& known,
                     const matching_context& context) {
  constexpr double apart = 2;  // [m] of two stems that fix a motion
  std::array<bool, 3> shared;
  for (std::size_t i = 0; i < 3; ++i)
    shared[i] = context.residual(known.target_from_source, triangle[i]) < 2 * known.inlier_threshold &&
                context.heights_agree(known.target_from_source * context.source.at[triangle[i].source],
                                      triangle[i].target);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    if (shared[i] && shared[j] &&
        stem_distance(context.target.at[triangle[i].target], context.target.at[triangle[j].target], true) >
            apart)
      return true;
  }
  return false;
}

/// Adds a hypothesis to distinct ones; where it is another view of some of them the best of all stays.
inline void add_distinct(local_hypothesis&& h, std::vector<local_hypothesis>& hypotheses,
                         const matching_context& context) {
  const auto is_twin = [&](const local_hypothesis& other) {
    return !differ(h, other, context, 2 * std::max(h.inlier_threshold, other.inlier_threshold));
  };
  std::vector<local_hypothesis> others;
  others.reserve(hypotheses.size() + 1);
  for (local_hypothesis& other : hypotheses) {
    if (!is_twin(other))
      others.push_back(std::move(other));
    else if (!ranks_before(h, other))
      h = std::move(other);
  }
  others.push_back(std::move(h));
  hypotheses = std::move(others);
}

/// The hypothesis seen from the other map.
inline local_hypothesis reversed(local_hypothesis h) {
  h.target_from_source = h.target_from_source.inverse();
  for (correspondence& c : h.correspondences) std::swap(c.source, c.target);
  std::sort(h.correspondences.begin(), h.correspondences.end());
  return h;
}

}  // namespace globalmatch::detail

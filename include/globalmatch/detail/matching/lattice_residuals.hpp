// Lattice residuals: under a wrong shift of its lattice the stems of a regular plantation have residuals as
// large as they were planted off their places; under the right one only as large as they were measured wrong.
// So have their radii. In: a transform that aligns the lattices. Out: the transforms of the
// lattice onto itself that fit best, and how many are expected to fit as well.
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/matching/evidence.hpp"
#include "globalmatch/detail/matching/lattice_alignment.hpp"
#include "globalmatch/detail/matching/planting_lattice.hpp"
#include "globalmatch/detail/matching/residual_null_model.hpp"
#include "globalmatch/detail/matching/verify.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// How well stems fit under the transforms of a lattice onto itself. Refers to the maps.
class lattice_residuals {
 public:
  /// `lattice` is the lattice of the target, and `initial` aligns that of the source with it. Cost: as many
  /// transforms as there are stems, or some more, of some hundreds of stems each; maps of so many that this
  /// is more than some millions have no score.
  lattice_residuals(const matching_context& context, const lattice_shifts& lattice, const rigid& initial)
      : context_(context), lattice_(lattice), step_((context.source.size() + enough - 1) / enough) {
    const vec3 pivot = central_position(initial);
    for (const double turn : lattice.turns()) traverse(refined(rigid::turn_about(pivot, turn) * initial));
    if (visited_ > max_visited || transforms_.size() < min_transforms) return;
    for (kind& k : kinds_) k.null_model = residual_null_model(k.of_transforms);
  }

  /// NFA of the place of the lattice that a transform is at: the probability under the null model that the
  /// stems fit as well in position, in radius, or in both together (Fisher's combination), times the
  /// transforms of the lattice onto itself. 0 where too little is known. The transform is fitted as those
  /// are: how well the given one fits the few pairs that it was found by is no evidence.
  evidence_score score(const rigid& target_from_source) const {
    const auto place = fit(pair_nearest(target_from_source));
    if (!place) return {0, evidence_source::residuals};
    std::vector<float> residuals[kind_count];
    find_residuals(*place, residuals);
    return score(residuals[0], residuals[1]);
  }

  /// Hypotheses of the transforms that fit best, at most `maximum`, verified over all stems as far as these
  /// are on the lattice, not scored.
  std::vector<local_hypothesis> propose(std::size_t maximum) const {
    std::vector<keyed> order;
    for (std::size_t i = 0; kinds_[0].null_model.is_known() && i < transforms_.size(); ++i) {
      poll_cancelled();
      const auto of = [&](int k) -> std::span<const float> { return kinds_[k].of_transforms[i]; };
      order.push_back({key_of(score(of(0), of(1)).log10_nfa + 0.0), i});
    }
    keep_first(order, maximum);
    std::vector<local_hypothesis> proposed;
    const double search_radius = lattice_.search_radius();
    for (const keyed& best : order)
      if (auto h =
              verify(context_, context_.pair_stems(transforms_[best.value], search_radius), search_radius))
        proposed.push_back(std::move(*h));
    return proposed;
  }

 private:
  static constexpr std::size_t enough = 512;  // source stems
  static constexpr std::size_t max_visited = 16'000'000, min_transforms = 20;
  static constexpr int kind_count = 2;

  /// One kind of residual, of each transform of the lattice onto itself; none where nothing is known of it.
  struct kind {
    evidence_source source;
    std::vector<std::vector<float>> of_transforms = {};  ///< [m]
    residual_null_model null_model = {};
  };

  bool radii_are_known() const { return !context_.source.radius.empty() && !context_.target.radius.empty(); }

  /// Source stems, some of many, with the target stems nearest horizontally, which may be shared.
  std::vector<correspondence> pair_nearest(const rigid& target_from_source) const {
    std::vector<correspondence> pairs;
    const double search_radius = lattice_.search_radius();
    for (stem_index s = 0; s < context_.source.size(); s += static_cast<stem_index>(step_)) {
      const vec3 transformed = target_from_source * context_.source.at[s];
      double nearest = search_radius;
      std::optional<stem_index> paired;
      context_.target_index->for_each_within(
          transformed.x, transformed.y, search_radius, [&](stem_index t, double) {
            const double distance =
                stem_distance(transformed, context_.target.at[t], context_.horizontal_distances());
            if (distance >= nearest) return;
            nearest = distance;
            paired = t;
          });
      if (paired) pairs.push_back({s, *paired});
    }
    return pairs;
  }

  /// A transform, and the pairs that it was fitted to and those that were left out.
  struct fitted_place {
    rigid transform;
    std::vector<correspondence> kept, left_out;
  };

  /// Of positions, and of radii less what all have in common; each as large as it would be had no fit to it
  /// taken some of the noise away.
  void find_residuals(const fitted_place& place, std::vector<float> (&residuals)[kind_count]) const {
    const double pairs_of_transform = context_.horizontal_distances() ? 3.0 / 2 : 6.0 / 3, of_median = 1;
    std::vector<double> radius_differences;
    const auto add = [&](std::span<const correspondence> pairs) {
      for (const auto& [s, t] : pairs) {
        residuals[0].push_back(float(context_.residual(place.transform, {s, t})));
        if (radii_are_known() && context_.source.radius[s] > 0 && context_.target.radius[t] > 0)
          radius_differences.push_back(context_.target.radius[t] - context_.source.radius[s]);
      }
    };
    add(place.kept);
    restore_noise(residuals[0], pairs_of_transform);
    add(place.left_out);
    residuals[1] = deviations_from_median(radius_differences);
    restore_noise(residuals[1], of_median);
  }

  /// A fit to residuals took away as much noise as so many of them have.
  static void restore_noise(std::vector<float>& residuals, double fitted) {
    const double pairs = double(residuals.size());
    if (pairs <= fitted) return;
    for (float& residual : residuals) residual *= float(std::sqrt(pairs / (pairs - fitted)));
  }

  static std::vector<float> deviations_from_median(const std::vector<double>& values) {
    std::vector<double> reordered = values;
    const double middle = median(reordered);
    std::vector<float> off;
    for (const double value : values) off.push_back(float(std::abs(value - middle)));
    return off;
  }

  /// A target stem amid those that source stems are near: turned about it the maps still overlap.
  vec3 central_position(const rigid& initial) const {
    position_set paired;
    for (const correspondence& c : pair_nearest(initial)) paired.at.push_back(context_.target.at[c.target]);
    return paired.at.empty() ? context_.target.at.front() : central_stem(paired);
  }

  /// Fitted to all pairs, then to those that are not far off: a stem that the other map does not show may be
  /// paired with any.
  std::optional<fitted_place> fit(std::span<const correspondence> pairs) const {
    constexpr double max_residual = 3;  // medians; one in five hundred is larger where all have normal noise
    if (pairs.size() < residual_null_model::min_pairs) return std::nullopt;
    const auto by_all = context_.fit(pairs);
    if (!by_all) return std::nullopt;
    const std::vector<double> residuals = context_.residuals(*by_all, pairs);
    std::vector<double> reordered = residuals;
    const double limit = max_residual * median(reordered);
    fitted_place place;
    for (std::size_t i = 0; i < pairs.size(); ++i)
      (residuals[i] <= limit ? place.kept : place.left_out).push_back(pairs[i]);
    const auto by_kept = context_.fit(place.kept);
    if (!by_kept) return fitted_place{*by_all, {pairs.begin(), pairs.end()}, {}};
    place.transform = *by_kept;
    return place;
  }

  /// A transform fitted to the stems it pairs until convergence: the lattice gives its yaw to some degrees
  /// only.
  rigid refined(rigid transform) const {
    constexpr int max_iterations = 20;
    std::vector<correspondence> before;
    for (int iteration = 0; iteration < max_iterations; ++iteration) {
      poll_cancelled();
      auto pairs = pair_nearest(transform);
      if (pairs == before) break;
      const auto place = fit(pairs);
      if (!place) break;
      transform = place->transform;
      before = std::move(pairs);
    }
    return transform;
  }

  /// A place of the lattice, in steps along both shifts, and a transform that is near the one there.
  struct lattice_place {
    std::int32_t i, j;
    rigid near;
    std::uint64_t key() const { return key_of(std::uint32_t(i), std::uint32_t(j)); }
  };

  /// Walks along the lattice, one place after the other, as far as enough stems match. Each transform is
  /// fitted, so that neither the lattice nor the yaw need be known well enough for places far away.
  void traverse(const rigid& start) {
    std::vector<lattice_place> ahead = {{0, 0, start}};
    std::vector<std::uint64_t> seen = {ahead[0].key()};  // increasing
    for (std::size_t next = 0; next < ahead.size() && visited_ <= max_visited; ++next) {
      poll_cancelled();
      visited_ += context_.source.size() / step_;
      const lattice_place at = ahead[next];
      const auto fitted = fit(pair_nearest(at.near));
      if (!fitted) continue;
      remember(*fitted);
      for (const vec2 step : {vec2{1, 0}, vec2{-1, 0}, vec2{0, 1}, vec2{0, -1}}) {
        const vec2 shift = step.x * lattice_.first + step.y * lattice_.second;
        const lattice_place beside{at.i + int(step.x), at.j + int(step.y),
                                   shifted_after(fitted->transform, {shift.x, shift.y, 0})};
        const auto known = std::lower_bound(seen.begin(), seen.end(), beside.key());
        if (known != seen.end() && *known == beside.key()) continue;
        seen.insert(known, beside.key());
        ahead.push_back(beside);
      }
    }
  }

  void remember(const fitted_place& place) {
    std::vector<float> residuals[kind_count];
    find_residuals(place, residuals);
    transforms_.push_back(place.transform);
    for (int k = 0; k < kind_count; ++k) kinds_[k].of_transforms.push_back(std::move(residuals[k]));
  }

  evidence_score score(std::span<const float> positions, std::span<const float> radii) const {
    const std::span<const float> residuals[kind_count] = {positions, radii};
    evidence_score best{0, evidence_source::residuals};
    double minimum = 0, product = 0;
    int asked = 0;
    for (int k = 0; k < kind_count; ++k) {
      if (!kinds_[k].null_model.is_known()) continue;
      const double log_probability = kinds_[k].null_model.log_probability(residuals[k]);
      product += log_probability;
      ++asked;
      if (log_probability >= minimum) continue;
      minimum = log_probability;
      best.source = kinds_[k].source;
    }
    if (asked == 0) return best;
    const double tests = asked > 1 ? asked + 1 : 1;  // each alone, and all together
    best.log10_nfa = std::log10(tests * double(transforms_.size())) +
                     std::min(minimum, log_product_tail(product, asked)) / std::numbers::ln10;
    return best;
  }

  const matching_context& context_;
  lattice_shifts lattice_;
  std::size_t step_;               // from one source stem that is looked at to the next
  std::size_t visited_ = 0;        // stems
  std::vector<rigid> transforms_;  // of the lattice onto itself
  kind kinds_[kind_count] = {{evidence_source::residuals}, {evidence_source::radii}};
};

}  // namespace globalmatch::detail

// Lattice residuals: wherever a stand in rows is laid on itself, its stems miss each other by as much as they
// were planted off their places; where it belongs, only by as much as they were measured wrong. So do their
// heights and radii. In: a motion that lays rows on rows. Out: the motions of the lattice onto itself that
// fit best, and how many would fit as well by chance.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <deque>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/lattice_alignment.hpp"
#include "globalmatch/detail/matching/planting_lattice.hpp"
#include "globalmatch/detail/matching/residual_null_model.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// What the pairs of a motion miss each other by; empty where nothing is known of it.
struct stem_residuals {
  std::vector<float> position;  ///< [m] as `matching_context::residual`
  std::vector<float> height;    ///< [m] apart from what all have in common
  std::vector<float> radius;    ///< [m] apart from what all have in common
};

/// How well stems fit under the motions of a lattice onto itself. Refers to the maps.
class lattice_residuals {
 public:
  /// `lattice` is the lattice of the target, and `initial` lays the rows of the source on it. Cost: as many
  /// motions as there are stems, or some more, of some hundreds of stems each; nothing is told in maps of so
  /// many that this is more than some millions.
  lattice_residuals(const matching_context& context, const lattice_shifts& lattice,
                    const rigid& initial)
      : context_(context), lattice_(lattice), step_((context.source.size() + enough - 1) / enough) {
    const vec3 pivot = central_position(initial);
    for (const double turn : lattice.turns())
      traverse(refined(rigid::turn_about(pivot, turn) * initial));
    if (visited_ > max_visited || transforms_.size() < min_transforms) return;
    position_model_ = residual_null_model(position_residuals_);
    if (context.uses_heights()) height_model_ = residual_null_model(height_residuals_);
    if (radii_are_known()) radius_model_ = residual_null_model(radius_residuals_);
  }

  /// How probable it is that by chance the stems fit as well, in place, in height, in radius, or in all of
  /// these together (Fisher's combination), times the motions of the lattice onto itself. What chance does is
  /// what these motions do. 0 where too little is known.
  evidence_score score(const rigid& target_from_source) const {
    return score(residuals_of(target_from_source, pair_nearest(target_from_source)));
  }

  /// Hypotheses of the motions that fit best, at most `maximum`, verified over all stems as far as these
  /// stand on the lattice, not weighed.
  std::vector<local_hypothesis> propose(std::size_t maximum) const {
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; position_model_.is_known() && i < transforms_.size(); ++i)
      order.push_back(
          {score({position_residuals_[i], height_residuals_[i], radius_residuals_[i]}).log10_nfa, i});
    const auto last = order.begin() + std::ptrdiff_t(std::min(maximum, order.size()));
    std::partial_sort(order.begin(), last, order.end());
    std::vector<local_hypothesis> proposed;
    for (auto o = order.begin(); o != last; ++o)
      if (auto h = verify(context_, context_.pair_stems(transforms_[o->second], lattice_.search_radius()),
                          lattice_.search_radius()))
        proposed.push_back(std::move(*h));
    return proposed;
  }

 private:
  static constexpr std::size_t enough = 512;  // source stems
  static constexpr std::size_t max_visited = 16'000'000, min_transforms = 20;

  bool radii_are_known() const { return !context_.source.radius.empty() && !context_.target.radius.empty(); }

  /// Source stems, some of many, with the target stems nearest in plan to where they are laid, which may be
  /// shared. In 4-DoF heights do not choose: they are to tell something.
  std::vector<correspondence> pair_nearest(const rigid& target_from_source) const {
    std::vector<correspondence> pairs;
    for (stem_index s = 0; s < context_.source.size(); s += static_cast<stem_index>(step_)) {
      const vec3 transformed = target_from_source * context_.source.at[s];
      double nearest = lattice_.search_radius();
      std::optional<stem_index> paired;
      context_.target_index->for_each_within(
          transformed.x, transformed.y, lattice_.search_radius(), [&](stem_index t, double) {
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

  stem_residuals residuals_of(const rigid& target_from_source,
                              std::span<const correspondence> pairs) const {
    stem_residuals residuals;
    std::vector<double> vertical_offsets, radius_differences;
    for (const auto& [s, t] : pairs) {
      residuals.position.push_back(float(context_.residual(target_from_source, {s, t})));
      if (context_.uses_heights())
        vertical_offsets.push_back(context_.target.at[t].z -
                                   (target_from_source * context_.source.at[s]).z);
      if (radii_are_known() && context_.source.radius[s] > 0 && context_.target.radius[t] > 0)
        radius_differences.push_back(context_.target.radius[t] - context_.source.radius[s]);
    }
    residuals.height = deviations_from_median(vertical_offsets);
    residuals.radius = deviations_from_median(radius_differences);
    return residuals;
  }

  static std::vector<float> deviations_from_median(const std::vector<double>& values) {
    auto reordered = values;
    const double middle = median(reordered);
    std::vector<float> off;
    for (const double value : values) off.push_back(float(std::abs(value - middle)));
    return off;
  }

  /// A target stem amid those that the source is laid on: turned about it the maps still overlap.
  vec3 central_position(const rigid& initial) const {
    position_set paired;
    for (const correspondence& c : pair_nearest(initial)) paired.at.push_back(context_.target.at[c.target]);
    return paired.at.empty() ? context_.target.at.front() : central_stem(paired);
  }

  /// A motion fitted to the stems it pairs until these stand: the lattice tells its yaw to some degrees only.
  rigid refined(rigid transform) const {
    constexpr int max_iterations = 20;
    std::vector<correspondence> before;
    for (int iteration = 0; iteration < max_iterations; ++iteration) {
      const auto pairs = pair_nearest(transform);
      const auto fitted = pairs.size() < residual_null_model::min_pairs || pairs == before
                              ? std::nullopt
                              : context_.fit(pairs);
      if (!fitted) break;
      transform = *fitted;
      before = pairs;
    }
    return transform;
  }

  /// Walks along the lattice, one place after the other, as far as enough stems meet. Each motion is fitted,
  /// so that neither the lattice nor the yaw need be known well enough for places far away.
  void traverse(const rigid& start) {
    using place = std::array<int, 2>;
    std::set<place> seen = {{0, 0}};
    std::deque<std::pair<place, rigid>> ahead = {{{0, 0}, start}};
    for (; !ahead.empty() && visited_ <= max_visited; ahead.pop_front()) {
      context_.poll_cancelled();
      visited_ += context_.source.size() / step_;
      const auto [at, near] = ahead.front();
      const auto pairs = pair_nearest(near);
      const auto transform =
          pairs.size() < residual_null_model::min_pairs ? std::nullopt : context_.fit(pairs);
      if (!transform) continue;
      stem_residuals residuals = residuals_of(*transform, pairs);
      transforms_.push_back(*transform);
      position_residuals_.push_back(std::move(residuals.position));
      height_residuals_.push_back(std::move(residuals.height));
      radius_residuals_.push_back(std::move(residuals.radius));
      for (const place step : {place{1, 0}, place{-1, 0}, place{0, 1}, place{0, -1}}) {
        const place next = {at[0] + step[0], at[1] + step[1]};
        if (!seen.insert(next).second) continue;
        const vec2 shift = step[0] * lattice_.first + step[1] * lattice_.second;
        ahead.push_back({next, shifted_after(*transform, {shift.x, shift.y, 0})});
      }
    }
  }

  evidence_score score(const stem_residuals& residuals) const {
    // Fits take some of the scatter away: of a motion, of what all heights and all radii have in common.
    const double by_transform = context_.horizontal_distances() ? 3.0 / 2 : 6.0 / 3, by_middle = 1;
    struct known {
      evidence_source by;
      const residual_null_model& null_model;
      const std::vector<float>& residuals;
      double fitted;
    };
    const known all[] = {{evidence_source::residuals, position_model_, residuals.position, by_transform},
                         {evidence_source::heights, height_model_, residuals.height, by_middle},
                         {evidence_source::radii, radius_model_, residuals.radius, by_middle}};
    evidence_score best{0, evidence_source::residuals};
    double minimum = 0, product = 0;
    int asked = 0;
    for (const known& k : all) {
      if (!k.null_model.is_known()) continue;
      const double null_model = k.null_model.log_probability(k.residuals, k.fitted);
      product += null_model;
      ++asked;
      if (null_model >= minimum) continue;
      minimum = null_model;
      best.evidence = k.by;
    }
    if (asked == 0) return best;
    const double tests = asked > 1 ? asked + 1 : 1;  // each alone, and all together
    best.log10_nfa = std::log10(tests * double(transforms_.size())) +
                     std::min(minimum, log_product_tail(product, asked)) / std::numbers::ln10;
    return best;
  }

  const matching_context& context_;
  lattice_shifts lattice_;
  std::size_t step_;         // from one source stem that is looked at to the next
  std::size_t visited_ = 0;  // stems
  // Motions of the lattice onto itself, and what is left between stems under each.
  std::vector<rigid> transforms_;
  std::vector<std::vector<float>> position_residuals_, height_residuals_, radius_residuals_;  // [m]
  residual_null_model position_model_, height_model_, radius_model_;
};

}  // namespace globalmatch::detail

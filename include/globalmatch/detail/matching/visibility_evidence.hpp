// Evidence of visibility: where a scanner saw past the place that a transform gives a stem of the other scan,
// no stem stands. In: hypotheses, and how far the scanner of either map saw. Out: how improbable it is that a
// transform hides so many stems if the maps have nothing in common. Ours.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/visible_ranges.hpp"
#include "globalmatch/detail/matching/evidence.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/detail/matching/scan_views.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/positions.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// Stems of one map that the other scan shows, or hides.
class hidden_stems {
 public:
  /// `stems` of one map are looked for in what the scanner of the other one, `others`, saw.
  hidden_stems(const position_set& stems, const position_set& others, const position_index& index_of_others,
               const scan_view& view)
      : stems_(stems), index_(index_of_others), view_(view) {
    if (is_known())
      terrain_from_local_ = view.ground->frame.local_from_scan() * others.frame.local_from_scan().inverse();
  }

  bool is_known() const { return view_.visible && !view_.visible->empty() && !stems_.radius.empty(); }

  /// Logarithm of the probability, if the maps had nothing in common, that the scanner saw past so few of the
  /// stems where `transform` places them, which is off by `error(place)` [m]. Stems near one of the other
  /// map are left out: positions have counted them. Stems in one direction, which one tree may hide, count
  /// together. How often it sees past any of them at random, and how much that varies, is what it does when
  /// all are turned about it.
  template <class Error>
  double log_probability(const rigid& transform, double near, const Error& error) const {
    constexpr std::size_t min_directions = 5;
    constexpr double max_share = 1.0 / 3;  // seen past; more are no evidence
    if (!is_known()) return 0;
    const std::vector<placed_stem> placed = place(transform, error);
    const counts given = count(placed, near, 0);
    if (given.directions < min_directions || double(given.past) > max_share * double(given.directions))
      return 0;
    share_statistics shares;
    for (std::size_t i = 1; i < directions; ++i)
      if (const counts turned = count(placed, near, double(i) * direction_width);
          turned.directions >= min_directions)
        shares.add(turned);
    if (shares.lots < double(directions) / 2) return 0;
    constexpr double smallest = -6 * std::numbers::ln10;  // so few turns do not show what is rarer
    return std::max(smallest, shares.log_tail(given));
  }

 private:
  static constexpr std::size_t directions = 36;
  static constexpr double direction_width = 2 * std::numbers::pi / double(directions);  // [rad]

  struct placed_stem {
    vec3 base, axis;  // frame of the terrain, from the scanner; z of the axis 1
    double radius, error;
    std::size_t direction;
  };
  struct counts {
    std::size_t directions = 0, past = 0;
  };

  /// Of the shares of directions that are seen past.
  struct share_statistics {
    double lots = 0, sum = 0, squares = 0, inverse_directions = 0;

    void add(const counts& c) {
      const double share = double(c.past) / double(c.directions);
      ++lots, sum += share, squares += share * share, inverse_directions += 1 / double(c.directions);
    }

    /// Logarithm of the probability of as few; mean and variance of the share are taken two of their standard
    /// deviations to the side where few are more probable.
    double log_tail(const counts& given) const {
      constexpr double deviations = 2, max_mean = 0.999, min_correlation = 1e-4, max_correlation = 0.99;
      const double mean_share = sum / lots;
      const double variance = std::max(0.0, squares / lots - mean_share * mean_share) *
                              (1 + deviations * std::sqrt(2 / (lots - 1)));
      const double mean = std::min(max_mean, mean_share - deviations * std::sqrt(variance / lots));
      if (!(mean > 0)) return 0;
      const double single = mean * (1 - mean), independent = single * inverse_directions / lots;
      const double correlation =
          std::clamp((variance - independent) / (single - independent), min_correlation, max_correlation);
      return log_beta_binomial_tail(given.past, given.directions, mean, correlation);
    }
  };

  /// Of the stems that would cover a cell of what the scanner saw.
  template <class Error>
  std::vector<placed_stem> place(const rigid& transform, const Error& error) const {
    std::vector<placed_stem> placed;
    for (stem_index s = 0; s < stems_.size(); ++s) {
      const vec3 at = transform * stems_.at[s];
      const vec3 base = terrain_from_local_ * at - view_.visible->scanner;
      const double radius = stems_.radius[s];
      if (!visible_ranges::is_covered(std::hypot(base.x, base.y), radius)) continue;
      const double sigma = stems_.sigma.empty() ? 0 : stems_.sigma[s];
      const double turns = (std::atan2(base.y, base.x) + std::numbers::pi) / direction_width;
      placed.push_back({base, axis_of(transform, s), radius, std::hypot(error(at), 2 * sigma),
                        std::min(std::size_t(turns), directions - 1)});
    }
    return placed;
  }

  vec3 axis_of(const rigid& transform, stem_index s) const {
    if (stems_.axis.empty()) return {0, 0, 1};
    const vec3 axis = terrain_from_local_.rotation * (transform.rotation * stems_.axis[s]);
    return axis.z > 0.5 ? axis / axis.z : vec3{0, 0, 1};
  }

  /// Of stems that are turned about the scanner by an angle [rad], counter-clockwise.
  counts count(std::span<const placed_stem> placed, double near, double angle) const {
    const double c = std::cos(angle), s = std::sin(angle);
    const auto turned = [&](const vec3& v) { return vec3{c * v.x - s * v.y, s * v.x + c * v.y, v.z}; };
    const rigid local_from_terrain = terrain_from_local_.inverse();
    std::array<bool, directions> has_stem = {}, is_past = {};
    for (const placed_stem& stem : placed) {
      vec3 base = turned(stem.base) + view_.visible->scanner;
      if (!view_.ground->covers(base.x, base.y) || is_near_other(local_from_terrain * base, near)) continue;
      has_stem[stem.direction] = true;
      if (is_past[stem.direction]) continue;
      base.z = view_.ground->interpolated_height(base.x, base.y);
      is_past[stem.direction] = view_.visible->sees_past(base, turned(stem.axis), stem.radius, stem.error);
    }
    return {std::size_t(std::count(has_stem.begin(), has_stem.end(), true)),
            std::size_t(std::count(is_past.begin(), is_past.end(), true))};
  }

  bool is_near_other(const vec3& p, double near) const {
    bool found = false;
    index_.for_each_within(p.x, p.y, near, [&](stem_index, double) { found = true; });
    return found;
  }

  const position_set& stems_;
  const position_index& index_;
  scan_view view_;
  rigid terrain_from_local_;
};

/// Refers to the maps.
class visibility_evidence {
 public:
  visibility_evidence(const matching_context& context, const scan_views& views)
      : context_(context),
        in_target_(context.source, context.target, *context.target_index, views.target),
        in_source_(context.target, context.source, *context.source_index, views.source) {}

  bool is_known() const { return in_target_.is_known() || in_source_.is_known(); }

  /// None: it proposes nothing.
  std::vector<local_hypothesis> propose(std::size_t) const { return {}; }

  /// The NFA of positions and visibility together, which are independent if maps have nothing in common, but
  /// where stems stand in rows: these hide each other at many places along them. Where visibility supports a
  /// transform that is shifted as well it is no evidence.
  evidence_score score(const local_hypothesis& h) const {
    constexpr double negligible = -2;  // `combined` asks for more
    const double of_h = log10_probability(h, h.target_from_source);
    const bool is_evidence = of_h < negligible && !fits_shifted(h, of_h);
    return {is_evidence ? combined(h.log10_nfa, of_h) : h.log10_nfa, evidence_source::visibility,
            h.log10_nfa_poisson};
  }

 private:
  /// Of both scans seeing past as few stems, for a transform that is not related to them, which places stems
  /// as exactly as a hypothesis does.
  double log10_probability(const local_hypothesis& h, const rigid& target_from_source) const {
    poll_cancelled();
    if (h.correspondences.size() < 3) return 0;
    const double near = std::max(1.0, 2 * h.inlier_threshold);  // [m]
    const fit_errors errors(h, context_);
    const double in_target =
        in_target_.log_probability(target_from_source, near, [&](const vec3& p) { return errors.at(p); });
    const double in_source = in_source_.log_probability(
        target_from_source.inverse(), near, [&](const vec3& p) { return errors.at(target_from_source * p); });
    return (in_target + in_source) / std::numbers::ln10;
  }

  /// Whether it supports the transform shifted some way in some direction, too.
  bool fits_shifted(const local_hypothesis& h, double of_h) const {
    constexpr double distances[] = {3, 4, 5};  // [m] further than `near`, and than any error
    constexpr double share = 0.5;              // of the logarithm, as of alternatives in `decision_options`
    constexpr int shifts = 36;
    for (const double distance : distances)
      for (int i = 0; i < shifts; ++i) {
        const double direction = 2 * std::numbers::pi * i / shifts;
        const rigid shifted = shifted_after(
            h.target_from_source, {distance * std::cos(direction), distance * std::sin(direction), 0});
        if (log10_probability(h, shifted) <= share * of_h) return true;
      }
    return false;
  }

  /// How far off [m], at two standard deviations, a transform is at a place, by the residuals of its pairs.
  class fit_errors {
   public:
    fit_errors(const local_hypothesis& h, const matching_context& context)
        : pairs_(double(h.correspondences.size())) {
      constexpr double min_sigma = 0.01;  // [m] of a pair
      for (const correspondence& c : h.correspondences) center_ += context.target.at[c.target] / pairs_;
      for (const correspondence& c : h.correspondences)
        spread_ += (context.target.at[c.target] - center_).xy().squared_norm();
      sigma_ = std::max(min_sigma, h.rms * std::sqrt(pairs_ / std::max(1.0, 2 * pairs_ - 3)));
    }
    double at(const vec3& place) const {
      constexpr double deviations = 2;
      return deviations * sigma_ *
             std::sqrt(1 / pairs_ + (place - center_).xy().squared_norm() / std::max(spread_, 1e-6));
    }

   private:
    double pairs_, sigma_ = 0, spread_ = 0;  // spread [m^2]
    vec3 center_;
  };

  /// If x is a product of n factors that are uniform between 0 and 1 it is below x with the probability x sum
  /// (-ln x)^j / j!, j < n (Fisher 1932). Positions are such a factor, once their NFA is divided by the
  /// number of transforms, of which there are 10^15 at most.
  static double combined(double log10_nfa, double log10_probability) {
    constexpr double log10_transforms = 15;
    const double product = log10_nfa + log10_probability;
    const double log_x = std::numbers::ln10 * std::max(0.0, log10_transforms - product);
    const double with_both = product + std::log10(1 + log_x + log_x * log_x / 2);
    return std::min(log10_nfa, with_both);
  }

  const matching_context& context_;
  hidden_stems in_target_, in_source_;
};

static_assert(evidence<visibility_evidence>);

}  // namespace globalmatch::detail

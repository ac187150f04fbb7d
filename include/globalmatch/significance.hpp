// Significance: could so many stems meet by chance? In: how the stems of the target stand. Out: the number of
// transforms that would do as well if the maps had nothing to do with each other. An a-contrario measure
// after [DMM] Desolneux, Moisan and Morel 2000, Meaningful alignments, Int. J. Computer Vision 40(1); as
// there, the fewer false alarms are expected, the less chance explains.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/hypothesis.hpp"
#include "globalmatch/plan_index.hpp"
#include "globalmatch/position_set.hpp"
#include "globalmatch/stand.hpp"
#include "globalmatch/statistics.hpp"

namespace globalmatch {

/// What chance can do between two maps. Refers to them.
class chance {
 public:
  /// `tolerances` [m] are those that stems may be paired at. What is asked at them, and at `others`, is
  /// computed once. `target_stand` is that of the target stems.
  chance(const map_pair& maps, std::shared_ptr<const stand> target_stand, std::span<const double> tolerances,
         std::span<const double> others = {})
      : maps_(maps),
        target_(std::move(target_stand)),
        source_extent_(extent(maps.source)),
        tolerances_(std::max<std::size_t>(1, tolerances.size())) {
    for (const auto& asked : {tolerances, others})
      for (const double tolerance : asked) known_.push_back(compute(tolerance));
    std::sort(known_.begin(), known_.end(),
              [](const chances& a, const chances& b) { return a.tolerance < b.tolerance; });
  }

  /// The same when nothing is known of the target. Cost: linear in the stems.
  explicit chance(const map_pair& maps, std::span<const double> tolerances = {})
      : chance(maps, std::make_shared<stand>(maps.target, maps.target_plan), tolerances) {}

  /// Probability that a source stem laid among the target stems lies within `tolerance` [m] of one by chance.
  double of_meeting(double tolerance) const { return at(tolerance).of_meeting; }

  /// From now on chance is at least as good as it is along the lattice of this stand.
  void reckon_with_rows_of(const stand& rows) {
    for (chances& known : known_)
      known.of_meeting = std::max(known.of_meeting, rows.of_meeting_along_lattice(known.tolerance));
  }

  /// What a motion makes of source stems.
  struct landing {
    double expected = 0;            ///< stems laid where target stems stand around
    std::vector<double> misfits;    ///< [m] from the nearest target stem, increasing, where one is near
    std::vector<double> explained;  ///< sums of the chances of being as near, of the first misfits
    double raised = 0;              ///< [m] by how much the motion was raised
    double matched(double tolerance) const {
      return double(std::lower_bound(misfits.begin(), misfits.end(), tolerance) - misfits.begin());
    }
  };

  /// Lays source stems, some thousands from all over where both maps are large, and looks for target stems
  /// within `reach` [m] of them: a sample is evidence enough, as long as it counts as no more than it is. In
  /// 4-DoF the motion is raised first to fit the heights of what lies within `tolerance` [m]; a target stem
  /// of another height may then hide one behind it, which makes what is matched a lower bound.
  landing lay(const Eigen::Isometry3d& target_from_source, double reach, double tolerance) const {
    constexpr std::size_t most_laid = 8192;
    const std::size_t smaller = std::min(maps_.source.size(), maps_.target.size());
    const std::size_t step = std::max<std::size_t>(1, (smaller + most_laid - 1) / most_laid);
    std::vector<meeting> meetings;
    landing result;
    for (std::size_t s = 0; s < maps_.source.size(); s += step) {
      const Eigen::Vector3d laid = target_from_source * maps_.source.at[s];
      meeting nearest{reach, 0};
      maps_.target_plan->for_each_within(laid.x(), laid.y(), reach, [&](stem_index t, double) {
        const Eigen::Vector3d& at = maps_.target.at[t];
        const double misfit = stem_distance(laid, at, maps_.in_plan());
        if (misfit < nearest.misfit) nearest = {misfit, at.z() - laid.z()};
      });
      if (target_->surrounds(laid)) ++result.expected;
      if (nearest.misfit < reach) meetings.push_back(nearest);
    }
    if (maps_.heights_tell()) result.raised = leave_agreeing(meetings, tolerance);
    for (const meeting& m : meetings) result.misfits.push_back(m.misfit);
    std::sort(result.misfits.begin(), result.misfits.end());
    result.explained = explain(result.misfits, &chances::of_meeting);
    return result;
  }

  /// Whether chance does as well as this motion for the source stems within `radius` [m in plan] of `center`.
  /// Not where few of them are laid among target stems: those tell nothing.
  bool explains_around(const Eigen::Isometry3d& target_from_source, const Eigen::Vector3d& center,
                       double radius, double tolerance) const {
    constexpr double few = 100, many = 1000, hardly = 1e-3;
    const double stems = std::min(double(maps_.source.size()),
                                  std::numbers::pi * std::pow(radius / maps_.source_plan->spacing(), 2));
    const auto step = std::max<std::size_t>(1, std::size_t(stems / many));  // some tell enough of many
    double laid_among = 0, met = 0;
    std::size_t passed = 0;
    maps_.for_each_source_within(center, radius, [&](stem_index s) {
      if (passed++ % step != 0) return;
      const Eigen::Vector3d laid = target_from_source * maps_.source.at[s];
      bool meets = false;
      maps_.for_each_met(laid, tolerance, [&](stem_index, double) { meets = true; });
      met += meets;
      laid_among += meets || target_->surrounds(laid);
    });
    return laid_among > few && log_binomial_tail(met, laid_among, of_meeting(tolerance)) > std::log(hardly);
  }

  /// Logarithm to base 10 of the expected number of false alarms: motions that would, by chance, lay stems as
  /// near to others as `landed`, at a tolerance [m]. A stem that meets another counts by 1 less the share
  /// that chance has, of all meetings, in those as close: 1 to 0, evenly, if it meets by chance (in plan the
  /// score of Torr and Zisserman 2000, MLESAC, Computer Vision and Image Understanding 78). Looked at are all
  /// motions that two pairs of stems fix (three in 6-DoF), at all tolerances; as many pairs then tell
  /// nothing. After Moisan and Stival 2004, A probabilistic criterion to detect rigid point matches, Int. J.
  /// Computer Vision 57(3), who count alike. Below 0 chance is an unlikely explanation.
  double log10_false_alarms(const landing& landed, double tolerance) const {
    return log10_false_alarms(landed, landed.explained, tolerance, at(tolerance).of_meeting);
  }

  /// Judges a hypothesis, of which `landed` is what its motion makes of the stems, at its tolerance.
  void judge(hypothesis& h, const landing& landed) const {
    h.log10_false_alarms = log10_false_alarms(landed, h.tolerance);
    h.log10_false_alarms_at_random =
        log10_false_alarms(landed, explain(landed.misfits, &chances::of_meeting_at_random), h.tolerance,
                           at(h.tolerance).of_meeting_at_random);
  }

 private:
  /// What is known of a tolerance [m].
  struct chances {
    double tolerance, of_meeting, of_meeting_at_random;
  };

  chances at(double tolerance) const {
    for (const chances& known : known_)
      if (known.tolerance == tolerance) return known;
    return compute(tolerance);
  }

  chances compute(double tolerance) const {
    const double at_random = target_->of_meeting_at_random(tolerance);
    return {tolerance, std::max(at_random, target_->of_meeting_along_lattice(tolerance)), at_random};
  }

  /// Sums of the chances of being as near, of the first misfits [m, increasing]. Between the tolerances that
  /// are known they grow with the area within reach. Copied stems, which meet exactly, are met by chance as
  /// well as others.
  std::vector<double> explain(const std::vector<double>& misfits, double chances::*of) const {
    constexpr double finest = 1e-4;  // [m] no stem's place is known better
    const auto square = [](double d) { return d * d; };
    std::vector<double> sums;
    chances below = {0, 0, 0};
    auto above = known_.begin();
    double sum = 0;
    for (const double given : misfits) {
      const double misfit = std::max(given, finest);
      while (above != known_.end() && above->tolerance <= misfit) below = *above++;
      if (above == known_.end()) {
        sum += compute(misfit).*of;
      } else {
        const double share =
            (square(misfit) - square(below.tolerance)) / (square(above->tolerance) - square(below.tolerance));
        sum += below.*of + share * ((*above).*of - below.*of);
      }
      sums.push_back(sum);
    }
    return sums;
  }

  double log10_false_alarms(const landing& landed, const std::vector<double>& explained, double tolerance,
                            double of_meeting) const {
    const double fixing = maps_.dof == degrees_of_freedom::four ? 2 : 3;
    const double matched = landed.matched(tolerance);
    double tail = 0;
    if (matched > fixing) {
      const double near = matched - explained[std::size_t(matched) - 1] / of_meeting;
      tail = log_uniform_sum_tail(near - fixing, std::max(landed.expected, matched) - fixing, of_meeting);
    }
    return (std::log(motions_at(tolerance)) + tail) / std::numbers::ln10;
  }

  /// A laid source stem and the target stem nearest to it.
  struct meeting {
    double misfit, rise;  // [m]
  };

  /// Removes meetings whose heights are too far from those of most within `tolerance` [m]; returns the rise
  /// [m] of these.
  double leave_agreeing(std::vector<meeting>& meetings, double tolerance) const {
    std::vector<double> rises;
    for (const meeting& m : meetings)
      if (m.misfit < tolerance) rises.push_back(m.rise);
    const double rise = rises.empty() ? 0 : median(rises);
    std::erase_if(meetings,
                  [&](const meeting& m) { return std::abs(m.rise - rise) >= maps_.vertical_tolerance; });
    return rise;
  }

  /// Motions that two pairs of stems fix (three in 6-DoF), at each of the tolerances: any two source stems,
  /// and target stems as far from each other as these are.
  double motions_at(double tolerance) const {
    const double sources = double(maps_.source.size()), targets = double(maps_.target.size());
    const double apart = std::min(source_extent_, target_->extent()) / 2;  // [m] two stems, typically
    // Stems of the ring of 2 pi `apart` by 2 `tolerance`, where one stands on pi `radius`^2.
    const double radius = target_->stem_radius();
    const double as_far = radius > 0 ? std::min(targets, 4 * apart * tolerance / (radius * radius)) : targets;
    const double by_two = targets * as_far * sources * sources / 2;
    const double by_all = maps_.dof == degrees_of_freedom::four ? by_two : by_two * sources * as_far;
    return std::max(1.0, by_all) * double(tolerances_);
  }

  const map_pair& maps_;
  std::shared_ptr<const stand> target_;
  double source_extent_ = 0;    // [m]
  std::size_t tolerances_ = 1;  // that stems may be paired at
  std::vector<chances> known_;
};

/// Judges a hypothesis, in the frames of `maps`, against chance, and pairs and fits it anew at the tolerance
/// [m] among `tolerances`, increasing, at which chance explains least. Cost: linear in the stems.
inline void weigh(hypothesis& h, const map_pair& maps, const chance& by_chance,
                  std::span<const double> tolerances) {
  constexpr int rounds = 4;
  constexpr double still = 0.1;  // of the tolerance
  for (int round = 0; round < rounds; ++round) {
    const double before = h.tolerance;
    const chance::landing landing = by_chance.lay(h.target_from_source, tolerances.back(), h.tolerance);
    h.target_from_source.translation().z() += landing.raised;
    h.log10_false_alarms = std::numeric_limits<double>::infinity();
    for (const double tolerance : tolerances) {
      const double alarms = by_chance.log10_false_alarms(landing, tolerance);
      if (alarms < h.log10_false_alarms) {
        h.log10_false_alarms = alarms;
        h.tolerance = tolerance;
      }
    }
    by_chance.judge(h, landing);
    const auto pairs = maps.pair_stems(h.target_from_source, h.tolerance);
    const auto motion = maps.fit(pairs);
    if (!motion) break;
    double moved = 0;
    for (const correspondence& c : pairs) {
      const Eigen::Vector3d& p = maps.source.at[c.source];
      moved += stem_distance(*motion * p, h.target_from_source * p, maps.in_plan()) / double(pairs.size());
    }
    h.target_from_source = *motion;
    if (moved < still * h.tolerance && h.tolerance == before) break;
  }
  h.correspondences = maps.pair_stems(h.target_from_source, h.tolerance);
  h.rms = maps.rms(h.target_from_source, h.correspondences);
}

}  // namespace globalmatch

// Significance: could so many stems meet by chance? In: a target map's density. Out: the number of transforms
// that would do as well if the maps had nothing to do with each other. An a-contrario measure after
// [DMM] Desolneux, Moisan and Morel 2000, Meaningful alignments, Int. J. Computer Vision 40(1); as there, the
// fewer false alarms are expected, the less chance explains.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/hypothesis.hpp"
#include "globalmatch/neighbors.hpp"
#include "globalmatch/plan_index.hpp"
#include "globalmatch/position_set.hpp"
#include "globalmatch/statistics.hpp"

namespace globalmatch {

/// Upper bound of the natural logarithm of the probability that of `tries` independent tries, each successful
/// with probability `p`, at least `successes` succeed: -tries * KL(successes / tries || p) (Hoeffding 1963).
inline double log_binomial_tail(double successes, double tries, double p) {
  if (successes <= tries * p || tries <= 0) return 0;
  if (p <= 0) return -std::numeric_limits<double>::infinity();
  const double share = std::min(1.0, successes / tries);
  const double misses = share < 1 ? (1 - share) * std::log((1 - share) / (1 - p)) : 0;
  return -tries * (share * std::log(share / p) + misses);
}

/// What chance can do between two maps. Refers to them.
class chance {
 public:
  /// What is asked at `tolerances` [m] is computed once. Cost: linear in the stems.
  explicit chance(const map_pair& maps, std::span<const double> tolerances = {}) : maps_(maps) {
    constexpr std::size_t neighbors = 6, most_looked_at = 2048;
    source_extent_ = extent(maps.source);
    target_extent_ = extent(maps.target);
    const std::size_t size = maps.target.size(),
                      k = std::min(neighbors, size - std::min<std::size_t>(size, 1));
    const std::size_t step = (size + most_looked_at - 1) / most_looked_at;
    std::vector<neighbor<double>> nearest;
    for (std::size_t i = 0; k >= 2 && i < size; i += step) {
      maps.target_plan->nearest(i, k, nearest);
      const double area = std::numbers::pi * nearest.back().squared_distance;
      densities_.push_back(area > 0 ? double(k - 1) / area : std::numeric_limits<double>::infinity());
    }
    auto sorted = densities_;
    const auto middle = sorted.begin() + std::ptrdiff_t(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    if (!sorted.empty()) stem_radius_ = 1 / std::sqrt(std::numbers::pi * *middle);
    shift_map_on_itself();
    for (const double tolerance : tolerances) {
      const double p = of_meeting(tolerance);
      known_.push_back({tolerance, p});
    }
  }

  /// Probability that a source stem laid among the target stems lies within `tolerance` [m] of one by chance:
  /// mean over places where target stems stand, so that it is not too small where they stand in clumps; and
  /// not less than the map meets itself when it is shifted from stem to stem, so that rows explain their own
  /// lattice. Heights, which would make it smaller, are left out.
  double of_meeting(double tolerance) const {
    if (densities_.empty()) return 1;
    for (const auto& [known_tolerance, p] : known_)
      if (known_tolerance == tolerance) return p;
    return std::max(of_meeting_at_random(tolerance), of_meeting_itself(tolerance));
  }

  /// What a motion makes of source stems.
  struct landing {
    double expected = 0;          ///< stems laid where target stems stand around
    std::vector<double> misfits;  ///< [m] from the nearest target stem, increasing, where one is near
    double weight = 1;            ///< stems that each of these stands for
    double raised = 0;            ///< [m] by how much the motion was raised
    double matched(double tolerance) const {
      return weight * double(std::lower_bound(misfits.begin(), misfits.end(), tolerance) - misfits.begin());
    }
  };

  /// Lays source stems, of large maps some thousands from all over, and looks for target stems within `reach`
  /// [m] of them. In 4-DoF the motion is raised first to fit the heights of what lies within `tolerance` [m];
  /// a target stem of another height may then hide one behind it, which makes what is matched a lower bound.
  landing lay(const Eigen::Isometry3d& target_from_source, double reach, double tolerance) const {
    constexpr double radii = 3;  // a circle of so many stem radii holds nine stems
    constexpr std::size_t most_laid = 8192;
    const std::size_t step = (maps_.source.size() + most_laid - 1) / most_laid;
    const double around = radii * stem_radius_;
    std::vector<meeting> meetings;
    landing result;
    result.weight = double(step);
    for (std::size_t s = 0; s < maps_.source.size(); s += step) {
      const Eigen::Vector3d laid = target_from_source * maps_.source.at[s];
      bool among = false;
      meeting nearest{reach, 0};
      maps_.target_plan->for_each_within(laid.x(), laid.y(), std::max(reach, around),
                                         [&](stem_index t, double squared) {
                                           among = among || squared < around * around;
                                           const Eigen::Vector3d& at = maps_.target.at[t];
                                           const double misfit = stem_distance(laid, at, maps_.in_plan());
                                           if (misfit < nearest.misfit) nearest = {misfit, at.z() - laid.z()};
                                         });
      result.expected += among ? result.weight : 0;
      if (nearest.misfit < reach) meetings.push_back(nearest);
    }
    if (maps_.heights_tell()) result.raised = leave_agreeing(meetings, tolerance);
    for (const meeting& m : meetings) result.misfits.push_back(m.misfit);
    std::sort(result.misfits.begin(), result.misfits.end());
    return result;
  }

  /// Logarithm to base 10 of the expected number of false alarms: motions in plan that can be told apart and
  /// that would, by chance, pair `matched` of `expected` stems within `tolerance` [m]. Two of the pairs fix
  /// the motion and tell nothing. Below 0 chance is an unlikely explanation.
  double log10_false_alarms(double matched, double expected, double tolerance) const {
    const double shifts = std::max(1.0, (source_extent_ + target_extent_) / tolerance);
    const double turns =
        std::max(1.0, std::numbers::pi * std::min(source_extent_, target_extent_) / tolerance);
    const double tries = std::max(expected, matched);
    const double tail = matched > 2 ? log_binomial_tail(matched - 2, tries - 2, of_meeting(tolerance)) : 0;
    return (2 * std::log(shifts) + std::log(turns) + tail) / std::numbers::ln10;
  }

 private:
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

  double of_meeting_at_random(double tolerance) const {
    double sum = 0;
    for (const double density : densities_)
      sum += -std::expm1(-density * std::numbers::pi * tolerance * tolerance);
    return sum / double(densities_.size());
  }

  /// Median over the shifts of the share of stems that meet another one; the stem that the shift was taken
  /// from does not count.
  double of_meeting_itself(double tolerance) const {
    if (shifted_.empty()) return 0;
    std::vector<double> shares;
    for (const auto& distances : shifted_) {
      const auto met = std::lower_bound(distances.begin(), distances.end(), tolerance) - distances.begin();
      shares.push_back(std::max(0.0, double(met - 1)) / double(looked_at_ - 1));
    }
    const auto middle = shares.begin() + std::ptrdiff_t(shares.size() / 2);
    std::nth_element(shares.begin(), middle, shares.end());
    return *middle;
  }

  /// Lays some target stems on the target map, shifted from stems to their nearest ones: in rows along the
  /// lattice. Keeps the distances [m in plan] to what they then meet.
  void shift_map_on_itself() {
    constexpr std::size_t origins = 8, shifts = 4, most_stems = 128;
    constexpr double reach = 1;  // [m]
    const std::vector<Eigen::Vector3d>& at = maps_.target.at;
    if (at.size() < 8) return;
    const std::size_t origin_step = at.size() / origins, step = (at.size() + most_stems - 1) / most_stems;
    looked_at_ = (at.size() + step - 1) / step;
    std::vector<neighbor<double>> nearest;
    for (std::size_t o = 0; o < origins; ++o) {
      maps_.target_plan->nearest(o * origin_step, shifts, nearest);
      for (const auto& n : nearest) {
        const Eigen::Vector3d shift = at[n.index] - at[o * origin_step];
        std::vector<double> distances;
        for (std::size_t i = 0; i < at.size(); i += step) {
          double least = reach * reach;
          maps_.target_plan->for_each_within(at[i].x() + shift.x(), at[i].y() + shift.y(), reach,
                                             [&](stem_index j, double squared) {
                                               if (j != i) least = std::min(least, squared);
                                             });
          if (least < reach * reach) distances.push_back(std::sqrt(least));
        }
        std::sort(distances.begin(), distances.end());
        shifted_.push_back(std::move(distances));
      }
    }
  }

  static double extent(const position_set& stems) {
    return std::max(middle_extent(stems, 0), middle_extent(stems, 1)) / middle_share;
  }

  const map_pair& maps_;
  double source_extent_ = 0, target_extent_ = 0;  // [m]
  double stem_radius_ = 0;                        // [m] of the circle that holds one stem
  std::vector<double> densities_;                 // [1 / m^2] of target stems, around some of them
  std::vector<std::vector<double>> shifted_;      // [m] from stems to what they meet, a list for each shift
  std::size_t looked_at_ = 1;                     // stems of which those are some
  std::vector<std::pair<double, double>> known_;  // tolerances, and the chance of meeting at each
};

/// Judges a hypothesis against chance, and pairs and fits it anew at the tolerance [m] among `tolerances`,
/// increasing, at which chance explains least.
inline void weigh(hypothesis& h, const map_pair& maps, const chance& by_chance,
                  std::span<const double> tolerances) {
  constexpr int rounds = 4;
  constexpr double still = 0.1;  // of the tolerance
  for (int round = 0; round < rounds; ++round) {
    const chance::landing landing = by_chance.lay(h.target_from_source, tolerances.back(), h.tolerance);
    h.target_from_source.translation().z() += landing.raised;
    h.log10_false_alarms = std::numeric_limits<double>::infinity();
    for (const double tolerance : tolerances) {
      const double alarms =
          by_chance.log10_false_alarms(landing.matched(tolerance), landing.expected, tolerance);
      if (alarms < h.log10_false_alarms) {
        h.log10_false_alarms = alarms;
        h.tolerance = tolerance;
      }
    }
    const auto pairs = maps.pair_stems(h.target_from_source, h.tolerance);
    const auto motion = maps.fit(pairs);
    if (!motion) break;
    double moved = 0;
    for (const correspondence& c : pairs) {
      const Eigen::Vector3d& p = maps.source.at[c.source];
      moved += stem_distance(*motion * p, h.target_from_source * p, maps.in_plan()) / double(pairs.size());
    }
    h.target_from_source = *motion;
    if (moved < still * h.tolerance) break;
  }
  h.correspondences = maps.pair_stems(h.target_from_source, h.tolerance);
  h.rms = maps.rms(h.target_from_source, h.correspondences);
}

}  // namespace globalmatch

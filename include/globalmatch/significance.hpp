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
/// with probability `p`, at least `successes` succeed: the first term of the tail, and a geometric series
/// that is above the others. 0 where so many are expected. Neither number need be whole.
inline double log_binomial_tail(double successes, double tries, double p) {
  if (successes <= tries * p || tries <= 0) return 0;
  if (p <= 0) return -std::numeric_limits<double>::infinity();
  const double k = std::min(successes, tries), misses = tries - k;
  const double first = std::lgamma(tries + 1) - std::lgamma(k + 1) - std::lgamma(misses + 1) +
                       k * std::log(p) + (misses > 0 ? misses * std::log1p(-p) : 0);
  const double ratio = misses * p / ((k + 1) * (1 - p));  // of a term and the one before; it falls further
  return std::min(0.0, first - std::log1p(-ratio));
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
    find_lattice();
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
    constexpr std::size_t most_laid = 8192;
    const std::size_t step = (maps_.source.size() + most_laid - 1) / most_laid;
    std::vector<meeting> meetings;
    landing result;
    result.weight = double(step);
    for (std::size_t s = 0; s < maps_.source.size(); s += step) {
      const Eigen::Vector3d laid = target_from_source * maps_.source.at[s];
      meeting nearest{reach, 0};
      maps_.target_plan->for_each_within(laid.x(), laid.y(), reach, [&](stem_index t, double) {
        const Eigen::Vector3d& at = maps_.target.at[t];
        const double misfit = stem_distance(laid, at, maps_.in_plan());
        if (misfit < nearest.misfit) nearest = {misfit, at.z() - laid.z()};
      });
      if (is_among_stems(laid)) result.expected += result.weight;
      if (nearest.misfit < reach) meetings.push_back(nearest);
    }
    if (maps_.heights_tell()) result.raised = leave_agreeing(meetings, tolerance);
    for (const meeting& m : meetings) result.misfits.push_back(m.misfit);
    std::sort(result.misfits.begin(), result.misfits.end());
    return result;
  }

  /// Whether chance does as well as this motion for the source stems within `radius` [m in plan] of `center`.
  /// Not where few of them are laid among target stems: those tell nothing.
  bool explains_around(const Eigen::Isometry3d& target_from_source, const Eigen::Vector3d& center,
                       double radius, double tolerance) const {
    constexpr double few = 100, many = 1000, hardly = 1e-3;
    const double stems = std::numbers::pi * std::pow(radius / maps_.source_plan.spacing(), 2);
    const auto step = std::max<std::size_t>(1, std::size_t(stems / many));  // some tell enough of many
    double laid_among = 0, met = 0;
    std::size_t passed = 0;
    maps_.for_each_source_within(center, radius, [&](stem_index s) {
      if (passed++ % step != 0) return;
      const Eigen::Vector3d laid = target_from_source * maps_.source.at[s];
      bool meets = false;
      maps_.for_each_met(laid, tolerance, [&](stem_index, double) { meets = true; });
      met += meets;
      laid_among += meets || is_among_stems(laid);
    });
    return laid_among > few && log_binomial_tail(met, laid_among, of_meeting(tolerance)) > std::log(hardly);
  }

  /// Logarithm to base 10 of the expected number of false alarms: motions that would, by chance, pair
  /// `matched` of `expected` stems within `tolerance` [m]. Looked at are all motions that two pairs of stems
  /// fix (three in 6-DoF), at all tolerances; these pairs then tell nothing. After Moisan and Stival 2004, A
  /// probabilistic criterion to detect rigid point matches, Int. J. Computer Vision 57(3), who count alike.
  /// Below 0 chance is an unlikely explanation.
  double log10_false_alarms(double matched, double expected, double tolerance) const {
    const double fixing = maps_.dof == degrees_of_freedom::four ? 2 : 3;
    const double tail =
        matched > fixing
            ? log_binomial_tail(matched - fixing, std::max(expected, matched) - fixing, of_meeting(tolerance))
            : 0;
    return (std::log(motions_at(tolerance)) + tail) / std::numbers::ln10;
  }

 private:
  static constexpr double radii_around = 3;  // a circle of so many stem radii holds nine stems

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

  /// Whether target stems stand around a laid source stem.
  bool is_among_stems(const Eigen::Vector3d& laid) const {
    return maps_.target_plan->any_within(laid.x(), laid.y(), radii_around * stem_radius_);
  }

  double of_meeting_at_random(double tolerance) const {
    double sum = 0;
    for (const double density : densities_)
      sum += -std::expm1(-density * std::numbers::pi * tolerance * tolerance);
    return sum / double(densities_.size());
  }

  /// Motions that two pairs of stems fix (three in 6-DoF), at each of the tolerances: any two source stems,
  /// and target stems as far from each other as these are.
  double motions_at(double tolerance) const {
    const double sources = double(maps_.source.size()), targets = double(maps_.target.size());
    const double apart = std::min(source_extent_, target_extent_) / 2;  // [m] two stems, typically
    // Stems of the ring of 2 pi `apart` by 2 `tolerance`, where one stands on pi `stem_radius_`^2.
    const double as_far =
        stem_radius_ > 0 ? std::min(targets, 4 * apart * tolerance / (stem_radius_ * stem_radius_)) : targets;
    const double by_two = targets * as_far * sources * sources / 2;
    const double by_all = maps_.dof == degrees_of_freedom::four ? by_two : by_two * sources * as_far;
    return std::max(1.0, by_all) * double(std::max<std::size_t>(known_.size(), 1));
  }

  /// Probability of meeting by chance along the lattice of the target map; 0 where it has none. Of stems met
  /// within a wider reach at least as many as of an evenly filled disc are nearer: few shifts can be looked
  /// at, and what they do not show at centimetres they may show at decimetres.
  double of_meeting_itself(double tolerance) const {
    // The shift of `find_lattice`, from one stem to another, is as uncertain as each meeting: a motion that
    // lays two lattices on each other is better by the root of two.
    const double wider = std::numbers::sqrt2 * tolerance;
    double p = 0;
    for (const auto& [reach, share] : lattice_)
      if (reach >= wider) p = std::max(p, share * std::pow(wider / reach, 2));
    return p;
  }

  /// Finds within which reach more target stems meet another one than random ones would, when the map is laid
  /// on itself, shifted from stems to their nearest ones: in rows along the lattice.
  void find_lattice() {
    constexpr double least = 0.03, hardly = 1e-3;  // [m]; chance of what random stems hardly do
    constexpr int reaches = 12;
    double tries = 0;
    const std::vector<double> misfits = misfits_on_itself(least * std::pow(2, 0.5 * (reaches - 1)), tries);
    for (int i = 0; i < reaches; ++i) {
      const double reach = least * std::pow(2, 0.5 * i);
      const auto met = double(std::lower_bound(misfits.begin(), misfits.end(), reach) - misfits.begin());
      if (met > 0 && log_binomial_tail(met, tries, of_meeting_at_random(reach)) < std::log(hardly))
        lattice_.push_back({reach, met / tries});
    }
  }

  /// Distances [m] less than `reach`, increasing, from shifted target stems to others. `tries` receives the
  /// number of stems that were laid where others stand around.
  std::vector<double> misfits_on_itself(double reach, double& tries) const {
    constexpr std::size_t origins = 8, shifts = 4, most_stems = 128;
    const std::vector<Eigen::Vector3d>& at = maps_.target.at;
    std::vector<double> misfits;
    if (at.size() < origins) return misfits;
    const std::size_t origin_step = at.size() / origins, step = (at.size() + most_stems - 1) / most_stems;
    std::vector<neighbor<double>> nearest;
    for (std::size_t o = 0; o < origins * origin_step; o += origin_step) {
      maps_.target_plan->nearest(o, shifts, nearest);
      for (const auto& n : nearest) {
        const Eigen::Vector3d shift = at[n.index] - at[o];
        for (std::size_t i = 0; i < at.size(); i += step) {
          if (i == o) continue;  // laid on the stem that the shift was taken from
          const Eigen::Vector3d laid = at[i] + shift;
          double least = reach * reach;
          maps_.target_plan->for_each_within(laid.x(), laid.y(), reach, [&](stem_index j, double squared) {
            if (j != i) least = std::min(least, squared);
          });
          if (least < reach * reach) misfits.push_back(std::sqrt(least));
          if (least < reach * reach || is_among_stems(laid)) ++tries;
        }
      }
    }
    std::sort(misfits.begin(), misfits.end());
    return misfits;
  }

  static double extent(const position_set& stems) {
    return std::max(middle_extent(stems, 0), middle_extent(stems, 1)) / middle_share;
  }

  const map_pair& maps_;
  double source_extent_ = 0, target_extent_ = 0;  // [m]
  double stem_radius_ = 0;                        // [m] of the circle that holds one stem
  std::vector<double> densities_;                 // [1 / m^2] of target stems, around some of them
  std::vector<std::pair<double, double>>
      lattice_;                                   // [m] reaches, and shares of shifted stems that meet within
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

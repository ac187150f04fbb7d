// How the stems of a map stand: how densely, and whether in rows. In: a stem map. Out: the probability that a
// stem laid among them, by chance, lies near one.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "globalmatch/neighbors.hpp"
#include "globalmatch/plan_index.hpp"
#include "globalmatch/position_set.hpp"
#include "globalmatch/statistics.hpp"

namespace globalmatch {

/// Larger of the extents [m] of a map along x and y, outliers aside.
inline double extent(const position_set& stems) {
  return std::max(middle_extent(stems, 0), middle_extent(stems, 1)) / middle_share;
}

/// A stand of stems. Immutable.
class stand {
 public:
  /// `plan` is that of `stems`. Cost: linear in the stems for the extent, the rest looks at some of them.
  stand(const position_set& stems, std::shared_ptr<const plan_index> plan)
      : plan_(std::move(plan)), extent_(globalmatch::extent(stems)) {
    constexpr std::size_t neighbors = 6, most_looked_at = 1024;
    const std::size_t size = stems.size(), k = std::min(neighbors, size - std::min<std::size_t>(size, 1));
    const std::size_t step = (size + most_looked_at - 1) / most_looked_at;
    std::vector<neighbor<double>> nearest;
    for (std::size_t i = 0; k >= 2 && i < size; i += step) {
      plan_->nearest(i, k, nearest);
      const double area = std::numbers::pi * nearest.back().squared_distance;
      densities_.push_back(area > 0 ? double(k - 1) / area : std::numeric_limits<double>::infinity());
    }
    if (densities_.empty()) return;
    auto sorted = densities_;
    stem_radius_ = 1 / std::sqrt(std::numbers::pi * median(sorted));
    find_lattice(stems);
  }

  /// [m] as the free function.
  double extent() const { return extent_; }
  /// Radius [m] of the circle that one stem has to itself, typically; 0 in maps of fewer than three stems.
  double stem_radius() const { return stem_radius_; }

  /// Probability that a stem laid among these lies within `tolerance` [m] of one by chance: mean over places
  /// where stems stand, so that it is not too small where they stand in clumps; and not less than the map
  /// meets itself when it is shifted from stem to stem, so that rows explain their own lattice. Heights,
  /// which would make it smaller, are left out. 1 in maps of fewer than three stems.
  double of_meeting(double tolerance) const {
    if (densities_.empty()) return 1;
    return std::max(of_meeting_at_random(tolerance), of_meeting_along_lattice(tolerance));
  }

  /// The same if stems stood at random, not in rows.
  double of_meeting_at_random(double tolerance) const {
    double sum = 0;
    for (const double density : densities_)
      sum += -std::expm1(-density * std::numbers::pi * tolerance * tolerance);
    return densities_.empty() ? 1 : sum / double(densities_.size());
  }

  /// Probability of meeting by chance along the lattice; 0 where the map has none. Of stems met within a
  /// wider reach at least as many as of an evenly filled disc are nearer: few shifts can be looked at, and
  /// what they do not show at centimetres they may show at decimetres. What is met within a narrower reach is
  /// met within the wider one.
  double of_meeting_along_lattice(double tolerance) const {
    // The shift of `find_lattice`, from one stem to another, is as uncertain as each meeting: a motion that
    // lays two lattices on each other is better by the root of two.
    const double wider = std::numbers::sqrt2 * tolerance;
    double p = lattice_.empty() ? 0 : likely_share_within(wider);
    for (const auto& [reach, share] : lattice_)
      p = std::max(p, share * std::min(1.0, std::pow(wider / reach, 2)));
    return p;
  }

  /// Whether stems repeat at some shifts more often than chance makes them.
  bool is_in_rows() const { return !lattice_.empty(); }

  /// Whether stems stand around a place.
  bool surrounds(const Eigen::Vector3d& place) const {
    return plan_->any_within(place.x(), place.y(), around * stem_radius_);
  }

 private:
  static constexpr double around = 3;  // stem radii: a circle that holds nine stems
  static constexpr double alike = 4;   // two like pairs of stems meet as each is laid on the other, and back

  static constexpr double least_reach = 0.03;                      // [m]
  static constexpr std::size_t reaches = 12, rings = reaches + 2;  // up to twice as far
  static double reach_of(std::size_t i) { return least_reach * std::pow(2, 0.5 * double(i)); }
  /// The first reach that a distance is less than, by its square [m^2].
  static std::size_t ring_of(double squared) {
    const double doublings = squared / (least_reach * least_reach);
    return doublings < 1 ? 0 : std::min(std::size_t(std::ilogb(doublings)) + 1, rings - 1);
  }

  /// What stems of a map meet that is laid on itself.
  struct meetings {
    double tries = 0;             ///< stems laid within the stand: what lies beyond its border tells nothing
    std::vector<double> nearest;  ///< [m] from these to the nearest stem, where within reach
    std::array<double, rings> met = {},
                              all = {};  ///< stems that meet another within each reach; all they meet
  };

  /// Finds within which reach more stems meet another one than chance makes them, when the map is laid on
  /// itself, shifted from stems to their nearest ones: in rows along the lattice. Chance is what random stems
  /// do, and what stems do that are met as densely just out of reach: clumps stay clumps a little aside, rows
  /// leave the ground beside them empty.
  void find_lattice(const position_set& stems) {
    constexpr double hardly = 1e-6;  // chance of what only rows do
    meetings own = meetings_with_itself(stems);
    for (std::size_t i = 0; i < reaches; ++i) {
      const double beside = (own.all[i + 2] - own.all[i]) / 3;  // up to twice as far, on thrice the area
      const double by_chance = std::max(of_meeting_at_random(reach_of(i)), -std::expm1(-beside / own.tries));
      if (own.met[i] > 0 &&
          log_binomial_tail(own.met[i] / alike, own.tries / alike, by_chance) < std::log(hardly))
        lattice_.push_back({reach_of(i), own.met[i] / own.tries});
    }
    if (lattice_.empty()) return;
    tries_ = own.tries;
    misfits_ = std::move(own.nearest);
    std::sort(misfits_.begin(), misfits_.end());
  }

  /// Of the stems that were shifted onto the map itself those that met another within `reach` [m].
  double share_within(double reach) const {
    const auto met = std::lower_bound(misfits_.begin(), misfits_.end(), reach) - misfits_.begin();
    return tries_ > 0 ? double(met) / tries_ : 0;
  }

  /// The share that may be behind it, as far as so few tell: two standard deviations above.
  double likely_share_within(double reach) const {
    const double share = share_within(reach);
    return std::min(1.0, share + 2 * std::sqrt(share * (1 - share) * alike / tries_));
  }

  meetings meetings_with_itself(const position_set& stems) const {
    constexpr std::size_t origins = 8, shifts = 4, most_stems = 32;
    const std::vector<Eigen::Vector3d>& at = stems.at;
    meetings own;
    if (at.size() < origins) return own;
    const std::size_t origin_step = at.size() / origins, step = (at.size() + most_stems - 1) / most_stems;
    std::vector<neighbor<double>> nearest;
    for (std::size_t o = 0; o < origins * origin_step; o += origin_step) {
      plan_->nearest(o, shifts, nearest);
      for (const auto& n : nearest) {
        const Eigen::Vector3d shift = at[n.index] - at[o];
        for (std::size_t i = 0; i < at.size(); i += step)
          if (i != o)  // which is laid on the stem that the shift was taken from
            lay(at[i] + shift, stem_index(i), own);
      }
    }
    std::partial_sum(own.met.begin(), own.met.end(), own.met.begin());
    std::partial_sum(own.all.begin(), own.all.end(), own.all.begin());
    return own;
  }

  /// Lays stem `itself`, which is not met there, at a place; counts what it meets by rings.
  void lay(const Eigen::Vector3d& place, stem_index itself, meetings& own) const {
    constexpr double farthest_off = 0.35;  // radii: half a circle of stems has its mean at 0.42
    const double reach = reach_of(rings - 1), radius = std::max(reach, around * stem_radius_);
    double nearest = reach * reach, count = 0;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    const auto before = own.all;
    plan_->for_each_within(place.x(), place.y(), radius, [&](stem_index j, double squared) {
      sum += plan_->at(j) - place.head<2>();
      ++count;
      if (j == itself || squared >= reach * reach) return;
      nearest = std::min(nearest, squared);
      ++own.all[ring_of(squared)];
    });
    if (count == 0 || sum.norm() >= farthest_off * radius * count) {
      own.all = before;
      return;
    }
    ++own.tries;
    if (nearest >= reach * reach) return;
    ++own.met[ring_of(nearest)];
    own.nearest.push_back(std::sqrt(nearest));
  }

  std::shared_ptr<const plan_index> plan_;
  double extent_ = 0, stem_radius_ = 0;  // [m]
  std::vector<double> densities_;        // [1 / m^2] around some of the stems
  std::vector<double> misfits_;          // [m] of the map on itself, increasing
  double tries_ = 0;                     // stems that were laid for them
  std::vector<std::pair<double, double>>
      lattice_;  // [m] reaches, and shares of shifted stems that meet within
};

}  // namespace globalmatch

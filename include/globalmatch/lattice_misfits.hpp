// Lattice misfits: wherever a stand in rows is laid on itself, its stems miss each other by as much as they
// were planted off their places; where it belongs, only by as much as they were measured wrong. So do their
// heights and radii. In: a motion that lays rows on rows. Out: the motions of the lattice onto itself that
// fit best, and how many would fit as well by chance.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

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

#include "globalmatch/hypothesis.hpp"
#include "globalmatch/lattice.hpp"
#include "globalmatch/misfits_by_chance.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/position_set.hpp"
#include "globalmatch/rows_on_rows.hpp"
#include "globalmatch/statistics.hpp"

namespace globalmatch {

/// What the pairs of a motion miss each other by; empty where nothing is known of it.
struct stem_misfits {
  std::vector<float> in_place;   ///< [m] as `map_pair::misfit`
  std::vector<float> in_height;  ///< [m] apart from what all have in common
  std::vector<float> in_radius;  ///< [m] apart from what all have in common
};

/// How well stems fit under the motions of a lattice onto itself. Refers to the maps.
class lattice_misfits {
 public:
  /// `rows` is the lattice of the target, and `on_it` lays the rows of the source on it. Cost: as many
  /// motions as there are stems, or some more, of some hundreds of stems each; nothing is told in maps of so
  /// many that this is more than some millions.
  lattice_misfits(const map_pair& maps, const lattice& rows, const Eigen::Isometry3d& on_it)
      : maps_(maps), rows_(rows), step_((maps.source.size() + enough - 1) / enough) {
    const Eigen::Vector3d pivot = place_in_the_middle(on_it);
    for (const double turn : rows.turns())
      walk(settled(Eigen::Translation3d(pivot) * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()) *
                   Eigen::Translation3d(-pivot) * on_it));
    if (looked_at_ > most_looked_at || motions_.size() < least_motions) return;
    in_place_ = misfits_by_chance(places_);
    if (maps.heights_tell()) in_height_ = misfits_by_chance(heights_);
    if (radii_are_known()) in_radius_ = misfits_by_chance(radii_);
  }

  /// How probable it is that by chance the stems fit as well, in place, in height, in radius, or in all of
  /// these together (Fisher's combination), times the motions of the lattice onto itself. What chance does is
  /// what these motions do. 0 where too little is known.
  testimony testimony_of(const Eigen::Isometry3d& target_from_source) const {
    return testimony_of(misfits_of(target_from_source, pair_nearest(target_from_source)));
  }

  /// Hypotheses of the motions that fit best, at most `most`, verified over all stems as far as these stand
  /// on the lattice, not weighed.
  std::vector<hypothesis> propose(std::size_t most) const {
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; in_place_.is_known() && i < motions_.size(); ++i)
      order.push_back({testimony_of({places_[i], heights_[i], radii_[i]}).log10_false_alarms, i});
    const auto last = order.begin() + std::ptrdiff_t(std::min(most, order.size()));
    std::partial_sort(order.begin(), last, order.end());
    std::vector<hypothesis> proposed;
    for (auto o = order.begin(); o != last; ++o)
      if (auto h = verify(maps_, maps_.pair_stems(motions_[o->second], rows_.reach()), rows_.reach()))
        proposed.push_back(std::move(*h));
    return proposed;
  }

 private:
  static constexpr std::size_t enough = 512;  // source stems
  static constexpr std::size_t most_looked_at = 16'000'000, least_motions = 20;

  bool radii_are_known() const { return !maps_.source.radius.empty() && !maps_.target.radius.empty(); }

  /// Source stems, some of many, with the target stems nearest in plan to where they are laid, which may be
  /// shared. In 4-DoF heights do not choose: they are to tell something.
  std::vector<correspondence> pair_nearest(const Eigen::Isometry3d& target_from_source) const {
    std::vector<correspondence> pairs;
    for (stem_index s = 0; s < maps_.source.size(); s += static_cast<stem_index>(step_)) {
      const Eigen::Vector3d laid = target_from_source * maps_.source.at[s];
      double nearest = rows_.reach();
      std::optional<stem_index> met;
      maps_.target_plan->for_each_within(laid.x(), laid.y(), rows_.reach(), [&](stem_index t, double) {
        const double distance = stem_distance(laid, maps_.target.at[t], maps_.in_plan());
        if (distance >= nearest) return;
        nearest = distance;
        met = t;
      });
      if (met) pairs.push_back({s, *met});
    }
    return pairs;
  }

  stem_misfits misfits_of(const Eigen::Isometry3d& target_from_source,
                          std::span<const correspondence> pairs) const {
    stem_misfits misfits;
    std::vector<double> rises, thicker;
    for (const auto& [s, t] : pairs) {
      misfits.in_place.push_back(float(maps_.misfit(target_from_source, {s, t})));
      if (maps_.heights_tell())
        rises.push_back(maps_.target.at[t].z() - (target_from_source * maps_.source.at[s]).z());
      if (radii_are_known() && maps_.source.radius[s] > 0 && maps_.target.radius[t] > 0)
        thicker.push_back(maps_.target.radius[t] - maps_.source.radius[s]);
    }
    misfits.in_height = off_the_median(rises);
    misfits.in_radius = off_the_median(thicker);
    return misfits;
  }

  static std::vector<float> off_the_median(const std::vector<double>& values) {
    auto reordered = values;
    const double middle = median(reordered);
    std::vector<float> off;
    for (const double value : values) off.push_back(float(std::abs(value - middle)));
    return off;
  }

  /// A target stem amid those that the source is laid on: turned about it the maps still overlap.
  Eigen::Vector3d place_in_the_middle(const Eigen::Isometry3d& on_it) const {
    position_set met;
    for (const correspondence& c : pair_nearest(on_it)) met.at.push_back(maps_.target.at[c.target]);
    return met.at.empty() ? maps_.target.at.front() : detail::stem_in_the_middle(met);
  }

  /// A motion fitted to the stems it pairs until these stand: the lattice tells its yaw to some degrees only.
  Eigen::Isometry3d settled(Eigen::Isometry3d motion) const {
    constexpr int rounds = 20;
    std::vector<correspondence> before;
    for (int round = 0; round < rounds; ++round) {
      const auto pairs = pair_nearest(motion);
      const auto fitted =
          pairs.size() < misfits_by_chance::least_pairs || pairs == before ? std::nullopt : maps_.fit(pairs);
      if (!fitted) break;
      motion = *fitted;
      before = pairs;
    }
    return motion;
  }

  /// Walks along the lattice, one place after the other, as far as enough stems meet. Each motion is fitted,
  /// so that neither the lattice nor the yaw need be known well enough for places far away.
  void walk(const Eigen::Isometry3d& start) {
    using place = std::array<int, 2>;
    std::set<place> seen = {{0, 0}};
    std::deque<std::pair<place, Eigen::Isometry3d>> ahead = {{{0, 0}, start}};
    for (; !ahead.empty() && looked_at_ <= most_looked_at; ahead.pop_front()) {
      maps_.say_on_the_way();
      looked_at_ += maps_.source.size() / step_;
      const auto [at, near] = ahead.front();
      const auto pairs = pair_nearest(near);
      const auto motion = pairs.size() < misfits_by_chance::least_pairs ? std::nullopt : maps_.fit(pairs);
      if (!motion) continue;
      stem_misfits misfits = misfits_of(*motion, pairs);
      motions_.push_back(*motion);
      places_.push_back(std::move(misfits.in_place));
      heights_.push_back(std::move(misfits.in_height));
      radii_.push_back(std::move(misfits.in_radius));
      for (const place step : {place{1, 0}, place{-1, 0}, place{0, 1}, place{0, -1}}) {
        const place next = {at[0] + step[0], at[1] + step[1]};
        if (!seen.insert(next).second) continue;
        const Eigen::Vector2d shift = step[0] * rows_.first + step[1] * rows_.second;
        ahead.push_back({next, Eigen::Translation3d(shift.x(), shift.y(), 0) * *motion});
      }
    }
  }

  testimony testimony_of(const stem_misfits& misfits) const {
    // Fits take some of the scatter away: of a motion, of what all heights and all radii have in common.
    const double by_motion = maps_.in_plan() ? 3.0 / 2 : 6.0 / 3, by_middle = 1;
    struct known {
      witness by;
      const misfits_by_chance& chance;
      const std::vector<float>& misfits;
      double fitted;
    };
    const known all[] = {{witness::misfits, in_place_, misfits.in_place, by_motion},
                         {witness::heights, in_height_, misfits.in_height, by_middle},
                         {witness::radii, in_radius_, misfits.in_radius, by_middle}};
    testimony told{0, witness::misfits};
    double least = 0, product = 0;
    int asked = 0;
    for (const known& k : all) {
      if (!k.chance.is_known()) continue;
      const double chance = k.chance.log_probability(k.misfits, k.fitted);
      product += chance;
      ++asked;
      if (chance >= least) continue;
      least = chance;
      told.told_by = k.by;
    }
    if (asked == 0) return told;
    const double tests = asked > 1 ? asked + 1 : 1;  // each alone, and all together
    told.log10_false_alarms = std::log10(tests * double(motions_.size())) +
                              std::min(least, log_product_tail(product, asked)) / std::numbers::ln10;
    return told;
  }

  const map_pair& maps_;
  lattice rows_;
  std::size_t step_;           // from one source stem that is looked at to the next
  std::size_t looked_at_ = 0;  // stems
  // Motions of the lattice onto itself, and what is left between stems under each.
  std::vector<Eigen::Isometry3d> motions_;
  std::vector<std::vector<float>> places_, heights_, radii_;  // [m]
  misfits_by_chance in_place_, in_height_, in_radius_;
};

}  // namespace globalmatch

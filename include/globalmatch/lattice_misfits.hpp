// Lattice misfits: wherever a stand in rows is laid on itself, its stems miss each other by as much as they
// were planted off their places; where it belongs, only by as much as they were measured wrong. In: a
// hypothesis that lays rows on rows. Out: the motions of the lattice onto itself that fit best, and how many
// would fit as well by chance.
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
#include "globalmatch/points.hpp"
#include "globalmatch/statistics.hpp"

namespace globalmatch {

/// How well stems fit under the motions of a lattice onto itself. Refers to the maps.
class lattice_misfits {
 public:
  /// `rows` is the lattice of the target, and `on_it` lays the rows of the source on it. Cost: as many
  /// motions as there are stems, or some more, of some hundreds of stems each; nothing is told in maps of so
  /// many that this is more than some millions.
  lattice_misfits(const map_pair& maps, const lattice& rows, const Eigen::Isometry3d& on_it)
      : maps_(maps), rows_(rows), step_((maps.source.size() + enough - 1) / enough) {
    const Eigen::Vector3d& pivot = maps.target.at.front();  // any place of the lattice
    for (const double turn : rows.turns())
      walk(Eigen::Translation3d(pivot) * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()) *
           Eigen::Translation3d(-pivot) * on_it);
    if (looked_at_ > most_looked_at || landings_.size() < least_motions) landings_.clear();
    if (landings_.empty()) return;
    count_misfits();
    std::vector<double> squares;
    for (const landing& l : landings_) {
      const agreement a = agreement_of(l.misfits);
      squares.push_back(std::pow(a.surprise - a.stems, 2) / a.stems);
    }
    scatter_ = std::max(1.0, median(squares) / median_of_chi_squared);
  }

  /// Logarithm to base 10 of the expected number of motions of the lattice onto itself that would, by chance,
  /// let the stems fit as well. What chance does is what these motions do: the misfit of a pair is worth the
  /// logarithm of the share of all misfits that are larger, the sum over the pairs of which is gamma
  /// distributed whatever the misfits are like, and as much wider as the sums of all motions are when stems
  /// are off their places together. 0 where too little is known.
  double log10_false_alarms(const Eigen::Isometry3d& target_from_source) const {
    if (landings_.empty()) return 0;
    const agreement a = agreement_of(misfits_of(target_from_source, pair_nearest(target_from_source)));
    return std::log10(double(landings_.size())) + log_chance(a) / std::numbers::ln10;
  }

  /// Hypotheses of the motions that fit best, at most `most`, verified over all stems as far as these stand
  /// on the lattice, not weighed.
  std::vector<hypothesis> propose(std::size_t most) const {
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < landings_.size(); ++i)
      order.push_back({log_chance(agreement_of(landings_[i].misfits)), i});
    const auto last = order.begin() + std::ptrdiff_t(std::min(most, order.size()));
    std::partial_sort(order.begin(), last, order.end());
    std::vector<hypothesis> proposed;
    for (auto o = order.begin(); o != last; ++o)
      if (auto h = verify(maps_, maps_.pair_stems(landings_[o->second].motion, rows_.reach()), rows_.reach()))
        proposed.push_back(std::move(*h));
    return proposed;
  }

 private:
  static constexpr std::size_t enough = 512;  // source stems
  static constexpr std::size_t most_looked_at = 16'000'000, least_motions = 20, least_pairs = 12;
  static constexpr double median_of_chi_squared = 0.455;  // of one degree of freedom

  /// A motion of the lattice onto itself, and what is left between stems under it.
  struct landing {
    Eigen::Isometry3d motion;
    std::vector<float> misfits;  // [m]
  };

  /// Sum over stems of how few misfits are smaller: as much as there are stems, by chance.
  struct agreement {
    double surprise = 0, stems = 0;
  };

  /// Source stems, some of many, with the target stems nearest to where they are laid, which may be shared.
  std::vector<correspondence> pair_nearest(const Eigen::Isometry3d& target_from_source) const {
    std::vector<correspondence> pairs;
    for (stem_index s = 0; s < maps_.source.size(); s += static_cast<stem_index>(step_)) {
      double nearest = rows_.reach();
      std::optional<stem_index> met;
      maps_.for_each_met(target_from_source * maps_.source.at[s], rows_.reach(),
                         [&](stem_index t, double distance) {
                           if (distance >= nearest) return;
                           nearest = distance;
                           met = t;
                         });
      if (met) pairs.push_back({s, *met});
    }
    return pairs;
  }

  std::vector<float> misfits_of(const Eigen::Isometry3d& target_from_source,
                                std::span<const correspondence> pairs) const {
    std::vector<float> misfits;
    for (const correspondence& c : pairs) misfits.push_back(float(maps_.misfit(target_from_source, c)));
    return misfits;
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
      const auto motion = pairs.size() < least_pairs ? std::nullopt : maps_.fit(pairs);
      if (!motion) continue;
      landings_.push_back({*motion, misfits_of(*motion, pairs)});
      for (const place step : {place{1, 0}, place{-1, 0}, place{0, 1}, place{0, -1}}) {
        const place next = {at[0] + step[0], at[1] + step[1]};
        if (!seen.insert(next).second) continue;
        const Eigen::Vector2d shift = step[0] * rows_.first + step[1] * rows_.second;
        ahead.push_back({next, Eigen::Translation3d(shift.x(), shift.y(), 0) * *motion});
      }
    }
  }

  /// Misfits of all motions, by their squares.
  static constexpr std::size_t bins = 4096;
  std::size_t bin_of(float misfit) const {
    return std::min(bins - 1, std::size_t(std::pow(misfit / rows_.reach(), 2) * double(bins)));
  }

  void count_misfits() {
    std::vector<double> counts(bins);
    double all = 0;
    for (const landing& l : landings_)
      for (const float misfit : l.misfits) {
        ++counts[bin_of(misfit)];
        ++all;
      }
    surprises_.assign(bins, 0);
    double larger = all;
    for (std::size_t b = 0; b < bins; ++b) {
      surprises_[b] = -std::log(std::max(0.5, larger - counts[b] / 2) / all);
      larger -= counts[b];
    }
  }

  agreement agreement_of(std::span<const float> misfits) const {
    agreement a{0, double(misfits.size())};
    for (const float misfit : misfits) a.surprise += surprises_[bin_of(misfit)];
    return a;
  }

  double log_chance(const agreement& a) const {
    // The motion was fitted to its pairs, which takes some of their scatter away.
    const double fitted = maps_.in_plan() ? 3.0 / 2 : 6.0 / 3;
    if (a.stems < least_pairs) return 0;
    return log_gamma_tail(a.surprise / scatter_, (a.stems - fitted) / scatter_);
  }

  const map_pair& maps_;
  lattice rows_;
  std::size_t step_;  // from one source stem that is looked at to the next
  std::vector<landing> landings_;
  std::size_t looked_at_ = 0;      // stems
  std::vector<double> surprises_;  // of misfits, by their squares
  double scatter_ = 1;             // of the sums of motions, by which it is wider than of independent pairs
};

}  // namespace globalmatch

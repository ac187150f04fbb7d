// Lattice gaps: a stand in rows looks alike wherever it is laid on itself, but for the gaps in it. In: a
// motion that lays rows on rows. Out: the motions of the lattice onto itself that lay gaps on gaps, and
// how many would by chance.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include "globalmatch/hypothesis.hpp"
#include "globalmatch/lattice.hpp"
#include "globalmatch/plan_index.hpp"
#include "globalmatch/position_set.hpp"
#include "globalmatch/statistics.hpp"

namespace globalmatch {

/// The gaps of two maps of stands in rows. Refers to the maps.
class lattice_gaps {
 public:
  /// `rows` is the lattice of the target; the source is taken to have the same one.
  lattice_gaps(const map_pair& maps, const lattice& rows, const Eigen::Isometry3d& on_it)
      : maps_(maps), rows_(rows), start_(on_it) {
    target_ = set_of(find_gaps(*maps.target_plan, rows));
    target_plan_ = plan_index(target_);
    // The source's lattice is that of the target, turned back.
    const Eigen::Rotation2Dd back(-yaw_of(start_));
    source_ = find_gaps(*maps.source_plan, {back * rows.first, back * rows.second});
    turns_ = rows.turns();
  }

  /// Motions of the lattice onto itself that would, by chance, lay as many gaps of the source on gaps of the
  /// target: each lies on one with the share of the places that are gaps.
  testimony testimony_of(const Eigen::Isometry3d& target_from_source) const {
    const double gaps = double(target_.size()), stems = double(maps_.target.size());
    double met = 0, tries = 0;
    for (const Eigen::Vector2d& gap : source_) {
      const Eigen::Vector2d laid = lay(target_from_source, gap);
      const bool meets = target_plan_.any_within(laid.x(), laid.y(), rows_.reach());
      met += meets;
      tries += meets || maps_.target_plan->any_within(laid.x(), laid.y(), rows_.reach());
    }
    const double motions = double(turns_.size()) * (gaps + stems + double(maps_.source.size()));
    const double chance = log_binomial_tail(met, tries, gaps / (gaps + stems));
    return {(std::log(motions) + chance) / std::numbers::ln10, witness::gaps};
  }

  /// Hypotheses of the motions that lay most gaps on gaps, at most `most`, verified over all stems as far as
  /// these stand on the lattice, not weighed. Cost: quadratic in the gaps, of which some hundreds are looked
  /// at.
  std::vector<hypothesis> propose(std::size_t most) const {
    std::vector<ballot> ballots = count_votes();
    const auto last = ballots.begin() + std::ptrdiff_t(std::min(most, ballots.size()));
    std::partial_sort(ballots.begin(), last, ballots.end(), [](const ballot& a, const ballot& b) {
      return a.votes != b.votes ? a.votes > b.votes : a.order < b.order;
    });
    std::vector<hypothesis> proposed;
    for (auto b = ballots.begin(); b != last; ++b) {
      if (auto h = verify(maps_, maps_.pair_stems(b->motion, rows_.reach()), rows_.reach()))
        proposed.push_back(std::move(*h));
    }
    return proposed;
  }

 private:
  /// A motion of the lattice onto itself, and the pairs of gaps that vote for it.
  struct ballot {
    Eigen::Isometry3d motion;
    std::size_t votes, order;
  };

  static double yaw_of(const Eigen::Isometry3d& motion) {
    return std::atan2(motion.linear()(1, 0), motion.linear()(0, 0));
  }

  static position_set set_of(const std::vector<Eigen::Vector2d>& places) {
    position_set set;
    for (const Eigen::Vector2d& p : places) set.at.push_back({p.x(), p.y(), 0});
    return set;
  }

  /// Gaps lie on no height; that of the motion is left alone.
  static Eigen::Vector2d lay(const Eigen::Isometry3d& target_from_source, const Eigen::Vector2d& place) {
    return (target_from_source * Eigen::Vector3d(place.x(), place.y(), 0)).head<2>();
  }

  std::vector<ballot> count_votes() const {
    constexpr std::size_t enough = 512;  // gaps of a map
    Eigen::Matrix2d basis;
    basis << rows_.first, rows_.second;
    const Eigen::Matrix2d inverse = basis.inverse();
    std::vector<ballot> ballots;
    if (source_.empty() || target_.at.empty()) return ballots;
    const std::size_t source_step = (source_.size() + enough - 1) / enough;
    const std::size_t target_step = (target_.size() + enough - 1) / enough;
    const Eigen::Vector3d& pivot = target_.at.front();  // any place of the lattice
    std::vector<std::array<double, 2>> votes;           // whole steps along both shifts
    for (const double turn : turns_) {
      const Eigen::Isometry3d turned = Eigen::Translation3d(pivot) *
                                       Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()) *
                                       Eigen::Translation3d(-pivot) * start_;
      votes.clear();
      for (std::size_t i = 0; i < source_.size(); i += source_step) {
        const Eigen::Vector2d laid = lay(turned, source_[i]);
        for (std::size_t j = 0; j < target_.size(); j += target_step) {
          const Eigen::Vector2d shift = target_.at[j].head<2>() - laid, steps = inverse * shift;
          const Eigen::Vector2d whole(std::round(steps.x()), std::round(steps.y()));
          if ((basis * whole - shift).norm() < rows_.reach()) votes.push_back({whole.x(), whole.y()});
        }
      }
      std::sort(votes.begin(), votes.end());
      for (std::size_t begin = 0, end = 0; begin < votes.size(); begin = end) {
        while (end < votes.size() && votes[end] == votes[begin]) ++end;
        const Eigen::Vector2d shift = basis * Eigen::Vector2d(votes[begin][0], votes[begin][1]);
        ballots.push_back(
            {Eigen::Translation3d(shift.x(), shift.y(), 0) * turned, end - begin, ballots.size()});
      }
    }
    return ballots;
  }

  const map_pair& maps_;
  lattice rows_;
  Eigen::Isometry3d start_;
  std::vector<double> turns_;
  position_set target_;
  plan_index target_plan_;
  std::vector<Eigen::Vector2d> source_;
};

}  // namespace globalmatch

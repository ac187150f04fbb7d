// Lattice gaps: a regular plantation looks alike under all shifts of its lattice, but for the gaps in it. In:
// a transform that aligns the lattices. Out: the transforms of the lattice onto itself under which gaps
// match, and how many are expected to.
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/position_index.hpp"
#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/matching/evidence.hpp"
#include "globalmatch/detail/matching/planting_lattice.hpp"
#include "globalmatch/detail/matching/verify.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// The gaps of two maps of regular plantations. Refers to the maps.
class lattice_gaps {
 public:
  /// `lattice` is the lattice of the target; the source is taken to have the same one.
  lattice_gaps(const matching_context& context, const lattice_shifts& lattice, const rigid& initial)
      : context_(context), lattice_(lattice), start_(initial), turns_(lattice.turns()) {
    for (const vec2& gap : find_gaps(*context.target_index, lattice)) target_.at.push_back({gap.x, gap.y, 0});
    target_index_ = position_index(target_);
    // The source's lattice is that of the target, turned back.
    const mat2 back = rotation_in_2d(-std::atan2(start_.rotation(1, 0), start_.rotation(0, 0)));
    source_ = find_gaps(*context.source_index, {back * lattice.first, back * lattice.second});
  }

  /// NFA: transforms of the lattice onto itself that are expected to place as many gaps of the source on
  /// gaps of the target: each is on one with the share of the places that are gaps.
  evidence_score score(const rigid& target_from_source) const {
    const double gaps = double(target_.size()), stems = double(context_.target.size());
    const double search_radius = lattice_.search_radius();
    double inliers = 0, trials = 0;
    for (const vec2& gap : source_) {
      const vec2 at = transformed_2d(target_from_source, gap);
      const bool is_inlier = target_index_.any_within(at.x, at.y, search_radius);
      inliers += is_inlier;
      trials += is_inlier || context_.target_index->any_within(at.x, at.y, search_radius);
    }
    const double number_of_tests = double(turns_.size()) * (gaps + stems + double(context_.source.size()));
    const double log_probability = log_binomial_tail(inliers, trials, gaps / (gaps + stems));
    return {(std::log(number_of_tests) + log_probability) / std::numbers::ln10, evidence_source::gaps};
  }

  /// Hypotheses of the transforms under which most gaps match, at most `maximum`, verified over all stems as
  /// far as these are on the lattice, not scored. Cost: gaps of the source times gaps of the target, of which
  /// some hundreds are looked at.
  std::vector<local_hypothesis> propose(std::size_t maximum) const {
    std::vector<rigid> transforms;
    std::vector<keyed> order;  // by most votes
    if (!source_.empty() && target_.size() > 0)
      for (const double turn : turns_) {
        const vec3& pivot = target_.at.front();  // any place of the lattice
        count_votes(rigid::turn_about(pivot, turn) * start_, transforms, order);
      }
    keep_first(order, maximum);
    std::vector<local_hypothesis> proposed;
    for (const keyed& best : order) {
      const double search_radius = lattice_.search_radius();
      if (auto h =
              verify(context_, context_.pair_stems(transforms[best.value], search_radius), search_radius))
        proposed.push_back(std::move(*h));
    }
    return proposed;
  }

 private:
  /// Gaps have no height; that of the transform is left alone.
  static vec2 transformed_2d(const rigid& target_from_source, const vec2& place) {
    return (target_from_source * vec3{place.x, place.y, 0}).xy();
  }

  /// Adds the shifts of the lattice, after `turned`, and how many pairs of gaps vote for each.
  void count_votes(const rigid& turned, std::vector<rigid>& transforms, std::vector<keyed>& order) const {
    constexpr std::size_t enough = 512;  // gaps of a map
    const mat2 basis = lattice_.basis(), inverse = basis.inverse();
    const std::size_t source_step = (source_.size() + enough - 1) / enough;
    const std::size_t target_step = (target_.size() + enough - 1) / enough;
    std::vector<keyed> votes;  // whole steps along both shifts
    for (std::size_t i = 0; i < source_.size(); i += source_step) {
      poll_cancelled();
      const vec2 transformed = transformed_2d(turned, source_[i]);
      for (std::size_t j = 0; j < target_.size(); j += target_step) {
        const vec2 shift = target_.at[j].xy() - transformed, steps = inverse * shift;
        const vec2 whole{std::round(steps.x), std::round(steps.y)};
        if ((basis * whole - shift).norm() < lattice_.search_radius())
          votes.push_back({key_of(whole.x + 0.0), key_of(whole.y + 0.0)});
      }
    }
    sort_keyed(votes);
    for (std::size_t begin = 0, end = 0; begin < votes.size(); begin = end) {
      while (end < votes.size() && votes[end].key == votes[begin].key &&
             votes[end].value == votes[begin].value)
        ++end;
      const vec2 shift = basis * vec2{number_of(votes[begin].key), number_of(votes[begin].value)};
      order.push_back({~std::uint64_t(end - begin), transforms.size()});
      transforms.push_back(shifted_after(turned, {shift.x, shift.y, 0}));
    }
  }

  const matching_context& context_;
  lattice_shifts lattice_;
  rigid start_;
  std::vector<double> turns_;
  position_set target_;
  position_index target_index_;
  std::vector<vec2> source_;
};

}  // namespace globalmatch::detail

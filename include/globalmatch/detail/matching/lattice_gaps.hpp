// Lattice gaps: a stand in rows looks alike wherever it is laid on itself, but for the gaps in it. In: a
// motion that lays rows on rows. Out: the motions of the lattice onto itself that lay gaps on gaps, and
// how many would by chance.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/position_index.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/planting_lattice.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// The gaps of two maps of stands in rows. Refers to the maps.
class lattice_gaps {
 public:
  /// `lattice` is the lattice of the target; the source is taken to have the same one.
  lattice_gaps(const matching_context& context, const lattice_shifts& lattice,
               const rigid& initial)
      : context_(context), lattice_(lattice), start_(initial) {
    target_ = set_of(find_gaps(*context.target_index, lattice));
    target_index_ = position_index(target_);
    // The source's lattice is that of the target, turned back.
    const mat2 back = rotation_in_2d(-yaw_of(start_));
    source_ = find_gaps(*context.source_index, {back * lattice.first, back * lattice.second});
    turns_ = lattice.turns();
  }

  /// Motions of the lattice onto itself that would, by chance, lay as many gaps of the source on gaps of the
  /// target: each lies on one with the share of the places that are gaps.
  evidence_score score(const rigid& target_from_source) const {
    const double gaps = double(target_.size()), stems = double(context_.target.size());
    double inliers = 0, trials = 0;
    for (const vec2& gap : source_) {
      const vec2 transformed = transformed_2d(target_from_source, gap);
      const bool is_inlier =
          target_index_.any_within(transformed.x, transformed.y, lattice_.search_radius());
      inliers += is_inlier;
      trials += is_inlier ||
                context_.target_index->any_within(transformed.x, transformed.y, lattice_.search_radius());
    }
    const double number_of_tests = double(turns_.size()) * (gaps + stems + double(context_.source.size()));
    const double log_probability = log_binomial_tail(inliers, trials, gaps / (gaps + stems));
    return {(std::log(number_of_tests) + log_probability) / std::numbers::ln10, evidence_source::gaps};
  }

  /// Hypotheses of the motions that lay most gaps on gaps, at most `maximum`, verified over all stems as far
  /// as these stand on the lattice, not weighed. Cost: quadratic in the gaps, of which some hundreds are
  /// looked at.
  std::vector<local_hypothesis> propose(std::size_t maximum) const {
    std::vector<candidate> candidates = count_votes();
    const auto last = candidates.begin() + std::ptrdiff_t(std::min(maximum, candidates.size()));
    std::partial_sort(candidates.begin(), last, candidates.end(), [](const candidate& a, const candidate& b) {
      return a.votes != b.votes ? a.votes > b.votes : a.order < b.order;
    });
    std::vector<local_hypothesis> proposed;
    for (auto b = candidates.begin(); b != last; ++b) {
      if (auto h = verify(context_, context_.pair_stems(b->transform, lattice_.search_radius()),
                          lattice_.search_radius()))
        proposed.push_back(std::move(*h));
    }
    return proposed;
  }

 private:
  /// A motion of the lattice onto itself, and the pairs of gaps that vote for it.
  struct candidate {
    rigid transform;
    std::size_t votes, order;
  };

  static double yaw_of(const rigid& transform) {
    return std::atan2(transform.rotation(1, 0), transform.rotation(0, 0));
  }

  static position_set set_of(const std::vector<vec2>& places) {
    position_set set;
    for (const vec2& p : places) set.at.push_back({p.x, p.y, 0});
    return set;
  }

  /// Gaps lie on no height; that of the motion is left alone.
  static vec2 transformed_2d(const rigid& target_from_source,
                                        const vec2& place) {
    return (target_from_source * vec3{place.x, place.y, 0}).xy();
  }

  std::vector<candidate> count_votes() const {
    constexpr std::size_t enough = 512;  // gaps of a map
    const mat2 basis = lattice_.basis(), inverse = basis.inverse();
    std::vector<candidate> candidates;
    if (source_.empty() || target_.at.empty()) return candidates;
    const std::size_t source_step = (source_.size() + enough - 1) / enough;
    const std::size_t target_step = (target_.size() + enough - 1) / enough;
    const vec3& pivot = target_.at.front();  // any place of the lattice
    std::vector<std::array<double, 2>> votes;           // whole steps along both shifts
    for (const double turn : turns_) {
      const rigid turned = rigid::turn_about(pivot, turn) * start_;
      votes.clear();
      for (std::size_t i = 0; i < source_.size(); i += source_step) {
        const vec2 transformed = transformed_2d(turned, source_[i]);
        for (std::size_t j = 0; j < target_.size(); j += target_step) {
          const vec2 shift = target_.at[j].xy() - transformed, steps = inverse * shift;
          const vec2 whole{std::round(steps.x), std::round(steps.y)};
          if ((basis * whole - shift).norm() < lattice_.search_radius())
            votes.push_back({whole.x, whole.y});
        }
      }
      std::sort(votes.begin(), votes.end());
      for (std::size_t begin = 0, end = 0; begin < votes.size(); begin = end) {
        while (end < votes.size() && votes[end] == votes[begin]) ++end;
        const vec2 shift = basis * vec2{votes[begin][0], votes[begin][1]};
        candidates.push_back(
            {shifted_after(turned, {shift.x, shift.y, 0}), end - begin, candidates.size()});
      }
    }
    return candidates;
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

// Evidence of a regular plantation, where positions alone explain every shift of the lattice: its gaps, and
// how well its stems fit.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "globalmatch/detail/matching/evidence.hpp"
#include "globalmatch/detail/matching/lattice_alignment.hpp"
#include "globalmatch/detail/matching/lattice_gaps.hpp"
#include "globalmatch/detail/matching/lattice_residuals.hpp"
#include "globalmatch/detail/matching/planting_lattice.hpp"

namespace globalmatch::detail {

/// Gaps at first, and residuals once asked for, which cost more. Refers to the maps.
class planting_evidence {
 public:
  /// `own` is the lattice of the source, `lattice` that of the target. At least one hypothesis is needed.
  planting_evidence(const matching_context& context, const std::optional<lattice_shifts>& own,
                    const lattice_shifts& lattice, std::span<const local_hypothesis> hypotheses)
      : context_(context),
        own_(own),
        lattice_(lattice),
        gaps_(context, lattice, align_lattices(context, own, lattice, hypotheses)) {}

  /// Which of the hypotheses aligns the lattices best is found again: gaps have added some.
  void use_residuals(std::span<const local_hypothesis> hypotheses) {
    residuals_.emplace(context_, lattice_, align_lattices(context_, own_, lattice_, hypotheses));
  }

  std::vector<local_hypothesis> propose(std::size_t maximum) const {
    return residuals_ ? residuals_->propose(maximum) : gaps_.propose(maximum);
  }
  evidence_score score(const local_hypothesis& h) const {
    return residuals_ ? residuals_->score(h.target_from_source) : gaps_.score(h.target_from_source);
  }

 private:
  const matching_context& context_;
  std::optional<lattice_shifts> own_;
  lattice_shifts lattice_;
  lattice_gaps gaps_;
  std::optional<lattice_residuals> residuals_;
};

static_assert(evidence<planting_evidence>);

}  // namespace globalmatch::detail

// Evidence of a natural stand where positions alone do not decide: radii of stems, and what scanners saw.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "globalmatch/detail/matching/evidence.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/detail/matching/radius_evidence.hpp"
#include "globalmatch/detail/matching/scan_views.hpp"
#include "globalmatch/detail/matching/visibility_evidence.hpp"

namespace globalmatch::detail {

/// Positions, with radii and visibility as far as these are known. Not for plantations: between the rows of
/// one that is placed on another scanners see past no stems, wherever along the rows it is. Refers to the
/// maps.
class natural_stand_evidence {
 public:
  /// `views`: what the scanners saw, or null.
  natural_stand_evidence(const matching_context& context, const scan_views* views) : radii_(context) {
    if (views) visibility_.emplace(context, *views);
  }

  bool is_known() const { return radii_.is_known() || (visibility_ && visibility_->is_known()); }

  /// None: it proposes nothing.
  std::vector<local_hypothesis> propose(std::size_t) const { return {}; }

  /// Names the last kind of evidence that supports the hypothesis.
  evidence_score score(const local_hypothesis& h) const {
    local_hypothesis supported = h;
    const auto support = [&](const evidence_score& scored) {
      if (scored.log10_nfa >= supported.log10_nfa) return;
      supported.log10_nfa = scored.log10_nfa;
      supported.evidence = scored.source;
    };
    if (radii_.is_known()) support(radii_.score(supported));
    if (visibility_ && visibility_->is_known()) support(visibility_->score(supported));
    return {supported.log10_nfa, supported.evidence, h.log10_nfa_poisson};
  }

 private:
  radius_evidence radii_;
  std::optional<visibility_evidence> visibility_;
};

static_assert(evidence<natural_stand_evidence>);

}  // namespace globalmatch::detail

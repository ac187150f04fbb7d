// All poses of a survey adjusted to its refined pairs, and what depends on them.
#pragma once

#include <span>

#include "globalmatch/detail/core/compiled.hpp"
#include "globalmatch/detail/survey/adjust_to_priors.hpp"
#include "globalmatch/detail/survey/levelled_survey.hpp"
#include "globalmatch/refinement_options.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch::detail {

GLOBALMATCH_INLINE void adjust_to_refinements(survey& result, std::span<const refined_pair> refined,
                                              build_mode) {
  require_valid_pairs(result, refined);
  adjust_beside_priors(result, refined);
}

}  // namespace globalmatch::detail

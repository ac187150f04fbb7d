#include <globalmatch/detail/verbs/adjust_to_refinements.hpp>
#include <globalmatch/detail/verbs/refine_stem_maps.hpp>
#include <globalmatch/survey_refinement.hpp>

#include <globalmatch/detail/verbs/grow_survey.hpp>
#include <globalmatch/detail/verbs/register_positions.hpp>
#include <globalmatch/growing_survey.hpp>
#include <globalmatch/survey.hpp>

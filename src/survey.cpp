#include <globalmatch/detail/verbs/register_positions.hpp>
#include <globalmatch/survey.hpp>

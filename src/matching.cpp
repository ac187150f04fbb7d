#include <globalmatch/detail/verbs/match_positions.hpp>
#include <globalmatch/stem_matching.hpp>

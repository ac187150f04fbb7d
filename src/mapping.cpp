#include <globalmatch/detail/verbs/find_stems.hpp>
#include <globalmatch/stem_mapping.hpp>

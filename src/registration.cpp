#include <globalmatch/detail/icp/refine_samples.hpp>
#include <globalmatch/detail/verbs/register_stem_maps.hpp>
#include <globalmatch/registration.hpp>

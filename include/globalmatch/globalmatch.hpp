// All of globalmatch. Whoever only has stem positions includes stem_matching.hpp instead.
#pragma once

#include "globalmatch/evaluation.hpp"
#include "globalmatch/icp.hpp"
#include "globalmatch/registration.hpp"
#include "globalmatch/stem_mapping.hpp"
#include "globalmatch/stem_matching.hpp"

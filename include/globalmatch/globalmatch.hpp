// All of globalmatch. Whoever only has stem positions includes stem_matching.hpp instead.
#pragma once

#include "globalmatch/evaluation.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/global_matching.hpp"
#include "globalmatch/icp.hpp"
#include "globalmatch/local_matching.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/matching_options.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"
#include "globalmatch/registration.hpp"
#include "globalmatch/stem_map.hpp"
#include "globalmatch/stem_mapping.hpp"
#include "globalmatch/stem_matching.hpp"
#include "globalmatch/transform.hpp"
#include "globalmatch/triangles.hpp"

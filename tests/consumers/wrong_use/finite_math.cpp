// Must say: compile without -ffast-math
// Options: -ffast-math
#include <globalmatch/points.hpp>

// Must say: compile without -ffast-math
// Options: -ffinite-math-only
#include <globalmatch/positions.hpp>

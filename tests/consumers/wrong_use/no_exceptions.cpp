// Must say: compile without -fno-exceptions
// Options: -fno-exceptions
#include <globalmatch/points.hpp>

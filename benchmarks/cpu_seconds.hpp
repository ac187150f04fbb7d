// Processor time of this process, all threads together.
#pragma once

#include <ctime>

namespace globalmatch::benchmarks {

inline double cpu_seconds() {
  return double(std::clock()) / CLOCKS_PER_SEC;
}

}  // namespace globalmatch::benchmarks

// The most memory that a piece of work made the process hold, on Linux.
#pragma once

#include <fstream>
#include <limits>
#include <string>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace globalmatch::benchmarks {

/// Forgets the peak so far, and hands back what earlier work no longer needs.
inline void reset_peak_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
  std::ofstream("/proc/self/clear_refs") << 5;
}

/// [MB] resident at most since the last reset, what the process held already included; not a number where
/// the system has no such number.
inline double peak_memory() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / 1024;
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace globalmatch::benchmarks

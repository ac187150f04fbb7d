// How many threads to use, and how many processors this process may use.
#pragma once

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>

#include "globalmatch/execution.hpp"

#ifdef __linux__
#include <sched.h>
#endif

namespace globalmatch::detail {

/// Processors that the quota of one control group grants, rounded up; the largest `int` without a quota.
/// `folder` ends in the group's path; version 2 has one file, version 1 has two.
inline int quota_of_group(const std::string& folder) {
  long long quota = 0, period = 0;
  if (!(std::ifstream(folder + "/cpu.max") >> quota >> period)) {
    std::ifstream(folder + "/cpu.cfs_quota_us") >> quota;
    std::ifstream(folder + "/cpu.cfs_period_us") >> period;
  }
  constexpr int unlimited = std::numeric_limits<int>::max();
  if (quota <= 0 || period <= 0) return unlimited;
  return int(std::min<long long>((quota - 1) / period + 1, unlimited));
}

/// Processors that the control groups of this process grant: the smallest quota of its groups and of those
/// around them, seen from where Linux distributions mount them. In a container the outermost that is seen is
/// the container's own. The largest `int` without a quota. `root` is for tests.
inline int cpu_quota(const std::string& root = "") {
  int smallest = std::numeric_limits<int>::max();
  std::ifstream groups(root + "/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {  // number:controllers:path
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    const bool version_2 = controllers == ",,";
    if (!version_2 && controllers.find(",cpu,") == std::string::npos) continue;
    const std::string mount = root + (version_2 ? "/sys/fs/cgroup" : "/sys/fs/cgroup/cpu");
    for (std::string path = line.substr(second + 1); !path.empty(); path.erase(path.rfind('/')))
      smallest = std::min(smallest, quota_of_group(mount + path));
    smallest = std::min(smallest, quota_of_group(mount));
  }
  return smallest;
}

/// Processors that the calling thread may run on: the smallest of the machine's, the affinity mask's and the
/// quota's number, at least 1. Machine and quota are read once and taken for constants of the process.
inline int available_processors() {
  static const int constant = [] {
    const unsigned machine = std::max(1u, std::thread::hardware_concurrency());
#ifdef __linux__
    return std::min(int(machine), cpu_quota());
#else
    return int(machine);
#endif
  }();
#ifdef CPU_COUNT
  cpu_set_t mask;
  if (sched_getaffinity(0, sizeof mask, &mask) == 0) return std::clamp(CPU_COUNT(&mask), 1, constant);
#endif
  return constant;
}

/// More threads than that only cost memory: the largest machines of today have some 800 processors.
inline constexpr int max_threads = 1024;

/// Throws `std::invalid_argument` when a field of `exec` makes no sense.
inline void require_valid(const execution& exec) {
  if (exec.threads < 0) throw std::invalid_argument("execution.threads must be 0 (all) or more");
}

/// Threads that `parallel_chunks` uses at most: as asked for up to `max_threads`, or one per processor.
inline int thread_count(const execution& exec) {
  require_valid(exec);
  return std::min(exec.threads > 0 ? exec.threads : available_processors(), max_threads);
}

}  // namespace globalmatch::detail

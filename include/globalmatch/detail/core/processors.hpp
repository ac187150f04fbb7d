// How many threads to use, and how many processors this process may use.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>

#include "globalmatch/execution.hpp"

#ifdef __linux__
#include <sched.h>
#endif

namespace globalmatch::detail {

/// A file of a few lines; empty when it cannot be read.
inline std::string read_small_file(const std::string& path) {
  char text[8192];
  std::FILE* const file = std::fopen(path.c_str(), "r");
  if (!file) return {};
  const std::size_t size = std::fread(text, 1, sizeof text, file);
  std::fclose(file);
  return {text, size};
}

/// Processors that the quota of one control group grants, rounded up; the largest `int` without a quota.
/// `folder` ends in the group's path; version 2 has one file, version 1 has two.
inline int quota_of_group(const std::string& folder) {
  const std::string both = read_small_file(folder + "/cpu.max");
  char* end = nullptr;
  long long quota = std::strtoll(both.c_str(), &end, 10), period = std::strtoll(end, nullptr, 10);
  if (quota <= 0 || period <= 0) {
    quota = std::strtoll(read_small_file(folder + "/cpu.cfs_quota_us").c_str(), nullptr, 10);
    period = std::strtoll(read_small_file(folder + "/cpu.cfs_period_us").c_str(), nullptr, 10);
  }
  constexpr int unlimited = std::numeric_limits<int>::max();
  if (quota <= 0 || period <= 0) return unlimited;
  return int(std::min<long long>((quota - 1) / period + 1, unlimited));
}

/// Where the control group of a line of /proc/self/cgroup (number:controllers:path) is mounted, and its path
/// there; no mount when it does not limit processors.
struct control_group {
  std::string mount, path;

  explicit control_group(const std::string& line) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) return;
    std::string controllers(line, first, second + 1 - first);  // with what separates them on both sides
    for (char& c : controllers)
      if (c == ',') c = ':';
    if (controllers == "::") mount = "/sys/fs/cgroup";
    if (controllers.find(":cpu:") != std::string::npos) mount = "/sys/fs/cgroup/cpu";
    path = line.substr(second + 1);
  }
};

/// Processors that the control groups of this process grant: the smallest quota of its groups and of those
/// around them, seen from where Linux distributions mount them. In a container the outermost that is seen is
/// the container's own. The largest `int` without a quota. `root` is for tests.
inline int cpu_quota(const std::string& root = "") {
  int smallest = std::numeric_limits<int>::max();
  const std::string groups = read_small_file(root + "/proc/self/cgroup");
  for (std::size_t begin = 0, end = 0; begin < groups.size(); begin = end + 1) {
    end = std::min(groups.find('\n', begin), groups.size());
    control_group group(groups.substr(begin, end - begin));
    if (group.mount.empty()) continue;
    group.mount.insert(0, root);
    for (std::size_t slash; (slash = group.path.rfind('/')) != std::string::npos; group.path.erase(slash))
      smallest = std::min(smallest, quota_of_group(group.mount + group.path));
    smallest = std::min(smallest, quota_of_group(group.mount));
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

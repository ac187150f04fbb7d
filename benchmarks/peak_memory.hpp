// The most memory that a piece of work made the process hold, on Linux.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <limits>
#include <string>
#include <thread>

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

/// Looks every millisecond at the anonymous memory of the process, that is without mapped files, from its
/// construction on.
class anonymous_memory {
 public:
  anonymous_memory() : before_(now()), thread_([this] { watch(); }) {}
  ~anonymous_memory() { stop(); }
  anonymous_memory(const anonymous_memory&) = delete;
  anonymous_memory& operator=(const anonymous_memory&) = delete;

  /// [MB] more than at first, at most; not a number where the system has no such number. Ends the watch.
  double peak() {
    stop();
    return peak_ - before_;
  }

 private:
  static double now() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
      if (line.starts_with("RssAnon:")) return std::stod(line.substr(8)) / 1024;
    return std::numeric_limits<double>::quiet_NaN();
  }

  void watch() {
    while (!is_over_) {
      peak_ = std::max(peak_, now());
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  void stop() {
    is_over_ = true;
    if (thread_.joinable()) thread_.join();
  }

  double before_, peak_ = before_;
  std::atomic<bool> is_over_ = false;
  std::thread thread_;  // the last member: it uses the others
};

}  // namespace globalmatch::benchmarks

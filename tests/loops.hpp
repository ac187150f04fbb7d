// Loops to look at: their sums, and the threads that they ran on.
#pragma once

#include <chrono>
#include <cmath>
#include <cstddef>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/execution.hpp"

namespace globalmatch::loops {

using namespace detail;

using std::chrono::milliseconds;
using clock = std::chrono::steady_clock;

/// Sum over chunks of numbers whose order of summation matters.
inline double chunked_sum(int threads, std::size_t count) {
  constexpr std::size_t chunk = 7;
  std::vector<double> sums((count + chunk - 1) / chunk);
  parallel_chunks({.threads = threads}, "sum", count, chunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) sums[begin / chunk] += 1 / std::pow(double(i + 1), 1.5);
  });
  double total = 0;
  for (const double s : sums) total += s;
  return total;
}

inline double seconds_since(clock::time_point start) {
  return std::chrono::duration<double>(clock::now() - start).count();
}

/// Keeps a thread busy without ever asking whether it should stop.
inline void work_for(milliseconds duration) {
  for (const auto start = clock::now(); clock::now() - start < duration;) continue;
}

/// The threads that worked on a loop of `chunks` chunks of 2 ms each.
inline std::set<std::thread::id> threads_of_loop(const execution& exec, std::size_t chunks) {
  std::mutex mutex;
  std::set<std::thread::id> threads;
  parallel_for(
      exec, "threads", chunks,
      [&](std::size_t) {
        std::this_thread::sleep_for(milliseconds(20));  // some systems start a thread in ten
        const std::lock_guard lock(mutex);
        threads.insert(std::this_thread::get_id());
      },
      1);
  return threads;
}

inline std::set<std::thread::id> this_thread_alone() {
  return {std::this_thread::get_id()};
}

}  // namespace globalmatch::loops

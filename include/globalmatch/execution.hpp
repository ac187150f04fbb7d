// How to run: threads, progress, cancel. The one seam to OpenMP.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <stdexcept>
#include <string_view>
#include <vector>

#ifdef _OPENMP
#include <omp.h>
/// Whatever runs in parallel lives in an inline namespace named by the threading it was compiled with, so
/// that translation units built with and without OpenMP can be linked into one program.
#define GLOBALMATCH_THREADING with_openmp
#else
#define GLOBALMATCH_THREADING without_openmp
#endif

namespace globalmatch {

/// What a progress callback is told.
struct progress {
  std::string_view stage;  ///< name of the step at work, e.g. "verticality"
  double fraction = 0;     ///< share of that step that is done, 0 to 1
};

/// How to run. The results are the same bits whatever is asked for here.
struct execution {
  /// Number of threads; 0: as many as OpenMP would take. 1 without OpenMP.
  int threads = 0;
  /// Called on the calling thread; returning false cancels. May be empty.
  std::function<bool(const progress&)> on_progress = {};
};

/// Thrown by single steps when the progress callback returned false. `map_stems`, `match_stems`,
/// `register_maps` and `register_scans` catch it and return `outcome::cancelled`.
struct operation_cancelled : std::runtime_error {
  operation_cancelled() : std::runtime_error("cancelled by the progress callback") {}
};

/// Reports progress from the calling thread. Throws `operation_cancelled`.
inline void report_progress(const execution& exec, std::string_view stage, double fraction) {
  if (exec.on_progress && !exec.on_progress({stage, fraction})) throw operation_cancelled();
}

/// Throws `std::invalid_argument` when a field of `exec` makes no sense.
inline void require_valid(const execution& exec) {
  if (exec.threads < 0) throw std::invalid_argument("execution.threads must be 0 (all) or more");
}

inline namespace GLOBALMATCH_THREADING {

/// Threads that `parallel_chunks` will use.
inline int thread_count(const execution& exec) {
  require_valid(exec);
#ifdef _OPENMP
  return exec.threads > 0 ? exec.threads : omp_get_max_threads();
#else
  return 1;
#endif
}

/// Calls `work(begin, end)` over [0, count) in chunks of `chunk`, in parallel. Chunks do not depend on the
/// number of threads, so whatever is written or summed per chunk is the same for any. The first exception in
/// chunk order is rethrown on the calling thread. Progress is reported, and cancel is heard, from the calling
/// thread.
template <class Work>
void parallel_chunks(const execution& exec, std::string_view stage, std::size_t count, std::size_t chunk,
                     const Work& work) {
  require_valid(exec);
  report_progress(exec, stage, 0);
  const auto chunks = static_cast<std::ptrdiff_t>((count + chunk - 1) / chunk);
  std::vector<std::exception_ptr> errors(static_cast<std::size_t>(chunks));
  std::atomic<std::ptrdiff_t> first_failed = chunks;
  const auto run = [&](std::ptrdiff_t c, bool calling_thread) {
    if (c > first_failed) return;  // earlier chunks still run: one of them may fail as well
    try {
      const std::size_t begin = static_cast<std::size_t>(c) * chunk;
      work(begin, std::min(count, begin + chunk));
      if (calling_thread) report_progress(exec, stage, double(c + 1) / double(chunks));
    } catch (...) {
      errors[static_cast<std::size_t>(c)] = std::current_exception();
      std::ptrdiff_t first = first_failed;
      while (c < first && !first_failed.compare_exchange_weak(first, c)) continue;
    }
  };
#ifdef _OPENMP
#pragma omp parallel for schedule(monotonic : dynamic, 1) num_threads(thread_count(exec)) if (chunks > 1)
  for (std::ptrdiff_t c = 0; c < chunks; ++c) run(c, omp_get_thread_num() == 0);
#else
  for (std::ptrdiff_t c = 0; c < chunks; ++c) run(c, true);
#endif
  for (const std::exception_ptr& error : errors)
    if (error) std::rethrow_exception(error);
}

/// `parallel_chunks` with one call `work(i)` for each index.
template <class Work>
void parallel_for(const execution& exec, std::string_view stage, std::size_t count, const Work& work,
                  std::size_t chunk = 1024) {
  parallel_chunks(exec, stage, count, chunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) work(i);
  });
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace globalmatch

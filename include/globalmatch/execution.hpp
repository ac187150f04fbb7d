// How to run: threads, progress, cancel. What runs is in detail/core/threads.hpp.
#pragma once

#include <functional>
#include <stdexcept>
#include <string_view>

namespace globalmatch {

/// What a progress callback gets.
struct progress {
  std::string_view stage;  ///< name of the step at work, e.g. "verticality"
  double fraction = 0;     ///< share of that step that is done, 0 to 1
};

/// How to run. The results are the same bits whatever is asked for here.
struct execution {
  /// Number of threads, the calling one included; 0: as many as there are processors for this process. Loops
  /// take fewer where they have less to do, and 1024 at most.
  int threads = 0;
  /// Called on the calling thread, about every 50 ms or more often; returning false cancels. May be empty.
  /// What it calls of this library runs on one thread.
  std::function<bool(const progress&)> on_progress = {};
};

/// Thrown by single steps when the progress callback returned false. `map_stems`, `match_stems`,
/// `register_maps` and `register_scans` catch it and return `outcome::cancelled`.
struct operation_cancelled : std::runtime_error {
  operation_cancelled() : std::runtime_error("cancelled by the progress callback") {}
};

}  // namespace globalmatch

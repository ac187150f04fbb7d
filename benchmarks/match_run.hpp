// One run of a way to match two maps: what it may take, and what came of it.
#pragma once

#include <globalmatch/detail/core/threads.hpp>
#include <globalmatch/execution.hpp>
#include <globalmatch/matching.hpp>

#include <Eigen/Geometry>

#include "support/programs/reports.hpp"

#include <limits>
#include <optional>

namespace globalmatch::benchmarks {

using namespace detail;

/// What a run may take.
struct run_limits {
  int threads = 0;                                           ///< 0: all
  double seconds = std::numeric_limits<double>::infinity();  ///< it is stopped then
  double memory = 4e9;  ///< [bytes] a run that is known to need more is not begun
};

/// What a matcher made of two maps.
struct match_run {
  std::optional<Eigen::Isometry3d> target_from_source = {};
  matching_funnel funnel = {};
  bool stopped = false;                 ///< by the limits; there is no transform then
  double seconds = 0, peak_memory = 0;  // peak in [MB]
  nlohmann::ordered_json stages = {};   // seconds of each
};

/// Times `match(exec)`, which returns a run. It is stopped by its polls (`poll_cancelled`) once the time is
/// up, and not begun where the `memory` [bytes] that it needs is too much.
template <class Match>
match_run run_within(const run_limits& limits, double memory, const Match& match) {
  support::stage_clock clock;
  execution exec = clock.listen(limits.threads);
  exec.on_progress = [&clock, &limits, listen = exec.on_progress](const progress& p) {
    return listen(p) && clock.seconds() < limits.seconds;
  };
  match_run run{.stopped = memory > limits.memory};
  try {
    const parallel_scope scope(exec, "matching");
    if (!run.stopped) run = match(exec);
  } catch (const operation_cancelled&) {
    run.stopped = true;
  }
  run.seconds = clock.seconds();
  run.stages = clock.stages();
  return run;
}

}  // namespace globalmatch::benchmarks

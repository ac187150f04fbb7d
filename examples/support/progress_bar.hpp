// How far a run has come, on a terminal; nothing where standard error is none.
#pragma once

#include <globalmatch/execution.hpp>

#include <chrono>
#include <iosfwd>

namespace globalmatch::support {

/// Draws the stage at work and its share on one line of standard error, ten times a second at most.
class progress_bar {
 public:
  progress_bar();
  /// `out` in place of standard error, drawn on whatever it is.
  explicit progress_bar(std::ostream& out);
  ~progress_bar() { clear(); }
  progress_bar(const progress_bar&) = delete;
  progress_bar& operator=(const progress_bar&) = delete;

  void show(const progress& p);
  /// Leaves an empty line to write on.
  void clear();

 private:
  using clock = std::chrono::steady_clock;
  std::ostream* out_ = nullptr;  // none: nothing is drawn
  clock::time_point drawn_ = {};
  bool is_drawn_ = false;
};

}  // namespace globalmatch::support

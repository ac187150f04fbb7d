// Loops in parallel, progress and cancelling, on the threads of the standard library.
//
// Threads live as long as the outermost `parallel_scope`, because starting and joining one for each loop
// costs 30 us, and waking one that waits 3 us. They start at the first loop of more than one chunk that is at
// work when the scope is 0.5 ms old, so that short calls have none.
#pragma once

#include <algorithm>
#include <condition_variable>  // brings the clocks; <chrono> has calendars too, which take longer to compile
#include <cstddef>
#include <exception>
#include <mutex>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/chunk_loop.hpp"
#include "globalmatch/detail/core/processors.hpp"
#include "globalmatch/execution.hpp"

namespace globalmatch::detail {

/// How often the callback is asked at least, as long as the work polls.
inline constexpr std::chrono::milliseconds poll_interval{50};

/// A call that is younger runs its loops alone: starting a thread takes the caller 10 us, and joining one
/// that has hardly started 30 us, or milliseconds where other programs keep the processors busy. Looked at
/// before each chunk and by `poll_cancelled`, so that one long chunk does not delay the others if it polls.
inline constexpr std::chrono::microseconds alone_at_first{500};

/// What a thread is in the middle of: a scope, a loop, a callback. The frames of a thread form a stack, which
/// tells `poll_cancelled` whom to ask, and loops whether they may use threads.
struct work_frame {
  work_frame() : outer(top()), serial(outer && outer->serial), team(outer ? outer->team : nullptr) {
    top() = this;
  }
  ~work_frame() { top() = outer; }
  work_frame(const work_frame&) = delete;
  work_frame& operator=(const work_frame&) = delete;

  /// The innermost frame of this thread, or null. In a function, because not all compilers on Windows link
  /// `inline thread_local` variables.
  static work_frame*& top() {
    static thread_local work_frame* innermost = nullptr;
    return innermost;
  }

  work_frame* const outer;
  bool serial;                      ///< loops below run on this thread alone
  bool is_callback = false;         ///< polls do not look further out
  class thread_team* team;          ///< of the outermost scope
  const execution* exec = nullptr;  ///< whom to ask; null on helpers and in callbacks
  std::string_view stage = {};      ///< what was reported last
  double fraction = 0;
  std::chrono::steady_clock::time_point asked = {};  ///< when the callback was asked last
  chunk_loop* loop = nullptr;
  std::size_t chunk = 0;    ///< of `loop`, at work on this thread
  std::size_t helpers = 0;  ///< to be called for `loop` once the outermost scope is old enough
  bool has_helpers = false;
};

/// Threads that wait for loops, and help with one at a time. Belongs to the thread that made it.
class thread_team {
 public:
  ~thread_team() {
    std::unique_lock lock(mutex_);
    closing_ = true;
    lock.unlock();
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

  /// When the scope that the team belongs to was opened.
  const std::chrono::steady_clock::time_point born = std::chrono::steady_clock::now();

  /// Has up to `helpers` threads work on `loop` until `wait` returned true.
  void open(chunk_loop& loop, std::size_t helpers) {
    const std::lock_guard lock(mutex_);
    loop_ = &loop;
    helpers_ = helpers;
    call_helper();
  }

  /// Lets no more threads in, and waits for those within; false when that takes longer than `poll_interval`.
  bool wait() {
    std::unique_lock lock(mutex_);
    loop_ = nullptr;
    return left_.wait_for(lock, poll_interval, [this] { return active_ == 0; });
  }

 private:
  /// Wakes or starts one thread, if the loop has work for it. Each thread that comes calls two more, so that
  /// the calling thread never waits for many to start, and short loops start few. Needs the lock.
  void call_helper() {
    if (active_ + called_ >= helpers_ || !loop_->has_more()) return;
    if (threads_.size() == active_ + called_ && !start_thread()) return;
    ++called_;
    wake_.notify_one();
  }

  /// False when the system has no thread to give; then the work goes on with fewer.
  bool start_thread() {
    try {
      if (!refused_) threads_.emplace_back([this] { serve(); });
    } catch (const std::exception&) {
      refused_ = true;
    }
    return !refused_;
  }

  void serve() {
    std::unique_lock lock(mutex_);
    while (true) {
      wake_.wait(lock, [this] { return closing_ || called_ > 0; });
      if (closing_) return;
      --called_;
      if (!loop_ || active_ >= helpers_) continue;  // came too late
      chunk_loop& loop = *loop_;
      ++active_;
      call_helper();
      call_helper();
      lock.unlock();
      help(loop);
      lock.lock();
      if (--active_ == 0) left_.notify_one();
    }
  }

  static void help(chunk_loop& loop) {
    work_frame here;
    here.serial = true;
    here.loop = &loop;
    while (loop.take(here.chunk)) loop.run(here.chunk);
  }

  std::mutex mutex_;
  std::condition_variable wake_, left_;
  std::vector<std::thread> threads_;
  chunk_loop* loop_ = nullptr;
  std::size_t helpers_ = 0;              // that `loop_` may have
  std::size_t active_ = 0, called_ = 0;  // threads at work on `loop_`; threads that will wake up
  bool closing_ = false, refused_ = false;
};

/// Has threads help with the loop of `frame` if it wants any and they are worth starting by now.
inline void call_helpers(work_frame& frame) {
  if (frame.helpers == 0 || std::chrono::steady_clock::now() - frame.team->born < alone_at_first) return;
  frame.has_helpers = true;
  frame.team->open(*frame.loop, std::exchange(frame.helpers, 0));
}

/// Stops the loops of this thread that an exception of the callback of `exec` leaves: it goes before what
/// their chunks throw.
inline void interrupt_loops(const execution& exec, const std::exception_ptr& error) {
  work_frame* outermost = nullptr;
  for (work_frame* frame = work_frame::top(); frame && !frame->is_callback; frame = frame->outer)
    if (frame->exec == &exec) outermost = frame;
  if (!outermost) return;
  for (work_frame* left = work_frame::top(); left != outermost->outer; left = left->outer)
    if (left->loop) left->loop->interrupt(error);
}

/// Reports progress from the calling thread. Throws `operation_cancelled`, or what the callback throws, and
/// interrupts the loops that this leaves.
/// `stage` is a literal: polls repeat it until the next report.
inline void report_progress(const execution& exec, std::string_view stage, double fraction) {
  if (!exec.on_progress) return;
  if (work_frame* const frame = work_frame::top(); frame && frame->exec == &exec) {
    frame->stage = stage;
    frame->fraction = fraction;
    frame->asked = std::chrono::steady_clock::now();
  }
  try {
    work_frame callback;
    callback.serial = callback.is_callback = true;
    if (!exec.on_progress({stage, fraction})) throw operation_cancelled();
  } catch (...) {
    interrupt_loops(exec, std::current_exception());
    throw;
  }
}

/// Asks the callback of the innermost frame that has one, unless it was asked within `poll_interval`; `now`:
/// asks that of the frame on top in any case.
inline void ask_callback(bool now = false) {
  work_frame* frame = work_frame::top();
  while (frame && !frame->is_callback && !(frame->exec && frame->exec->on_progress)) frame = frame->outer;
  if (!frame || frame->is_callback) return;
  const auto time = std::chrono::steady_clock::now();
  if (!(now && frame == work_frame::top()) && time - frame->asked < poll_interval) return;
  frame->asked = time;
  report_progress(*frame->exec, frame->stage, frame->loop ? frame->loop->fraction() : frame->fraction);
}

/// Throws `operation_cancelled` when the work at hand is cancelled, or has no use since an earlier chunk
/// failed. All work that takes longer than some 10 ms calls this every 0.1 ms or so. Reads an atomic and, on
/// the thread that called, the clock; that thread asks the callback when `poll_interval` has passed, and
/// starts helpers. Does nothing outside of loops and of a `parallel_scope`.
inline void poll_cancelled() {
  for (work_frame* frame = work_frame::top(); frame && !frame->is_callback; frame = frame->outer) {
    if (frame->loop && frame->loop->is_stopped(frame->chunk)) throw operation_cancelled();
    call_helpers(*frame);
  }
  ask_callback();
}

/// A stretch of work under `exec`: loops within share the threads of the outermost scope, and
/// `poll_cancelled` asks the callback of the innermost. Functions that run several loops, or long work
/// outside of loops, open one first. Costs nothing to open; closing joins the threads that were started.
/// `exec` must outlive it.
class parallel_scope {
 public:
  /// `stage` is a literal: what polls report until `report_progress` says otherwise.
  parallel_scope(const execution& exec, std::string_view stage) {
    require_valid(exec);
    frame_.exec = &exec;
    frame_.stage = stage;
    frame_.asked = std::chrono::steady_clock::now();
    if (!frame_.team) frame_.team = &team_;
  }

 private:
  friend void run_chunks(const execution&, std::string_view, std::size_t, std::size_t, const void*,
                         chunk_loop::function);

  /// Runs the chunks of `loop` on this thread and, if there are several, on others.
  void run(chunk_loop& loop) {
    report_progress(*frame_.exec, frame_.stage, 0);
    frame_.loop = &loop;
    if (loop.chunks() > 1 && !std::exchange(frame_.serial, true))
      frame_.helpers = std::min(std::size_t(thread_count(*frame_.exec)), loop.chunks()) - 1;
    call_helpers(frame_);
    try {
      while (loop.take(frame_.chunk) && loop.run(frame_.chunk)) {
        call_helpers(frame_);
        ask_callback(true);
      }
      while (frame_.has_helpers && !frame_.team->wait()) ask_callback();
    } catch (...) {  // from the callback; the loop has it
      while (frame_.has_helpers && !frame_.team->wait()) continue;
    }
    loop.rethrow();
    if (loop.chunks() > 0 && frame_.fraction < 1) ask_callback(true);
  }

  work_frame frame_;
  thread_team team_;  // joined before the frame goes
};

/// Not a template, so that a loop costs its caller one call.
inline void run_chunks(const execution& exec, std::string_view stage, std::size_t count, std::size_t chunk,
                       const void* work, chunk_loop::function call) {
  chunk_loop loop(count, chunk, work, call);
  parallel_scope(exec, stage).run(loop);
}

/// Calls `work(begin, end)` over [0, count) in chunks of `chunk`, in parallel. Chunks do not depend on the
/// number of threads, so whatever is written or summed per chunk is the same for any. The first exception in
/// chunk order is rethrown on the calling thread, once no other works any more; what the callback throws goes
/// before that. Progress is reported, and cancel is heard, on the calling thread: after each of its chunks,
/// when `work` polls, and every `poll_interval` while it waits for others. Within chunks of a loop of
/// several, and within the callback, loops run on one thread.
template <class Work>
void parallel_chunks(const execution& exec, std::string_view stage, std::size_t count, std::size_t chunk,
                     const Work& work) {
  run_chunks(exec, stage, count, chunk, &work, [](const void* erased, std::size_t begin, std::size_t end) {
    (*static_cast<const Work*>(erased))(begin, end);
  });
}

/// `parallel_chunks` with one call `work(i)` for each index.
template <class Work>
void parallel_for(const execution& exec, std::string_view stage, std::size_t count, const Work& work,
                  std::size_t chunk = 1024) {
  run_chunks(exec, stage, count, chunk, &work, [](const void* erased, std::size_t begin, std::size_t end) {
    const Work& each = *static_cast<const Work*>(erased);
    for (std::size_t i = begin; i < end; ++i) each(i);
  });
}

}  // namespace globalmatch::detail

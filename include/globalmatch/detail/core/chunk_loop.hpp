// A loop in chunks, as the threads that run it share it.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <limits>
#include <mutex>
#include <utility>

namespace globalmatch::detail {

/// What the threads of one loop share: chunks to take in order, and what went wrong.
class chunk_loop {
 public:
  using function = void (*)(const void* work, std::size_t begin, std::size_t end);

  chunk_loop(std::size_t count, std::size_t chunk, const void* work, function call)
      : count_(count),
        chunk_(std::max<std::size_t>(chunk, 1)),
        chunks_(count / chunk_ + (count % chunk_ != 0)),
        work_(work),
        call_(call) {}

  std::size_t chunks() const { return chunks_; }
  double fraction() const { return chunks_ == 0 ? 1 : double(done_) / double(chunks_); }
  bool has_more() const { return next_ < std::min(chunks_, limit_.load()); }

  /// Whether chunk `c` has no use any more: an earlier one failed, or all are cancelled.
  bool is_stopped(std::size_t c) const { return c >= limit_.load(std::memory_order_relaxed); }

  /// Takes the next chunk and writes its number to `at`; false when there is none.
  bool take(std::size_t& at) {
    at = next_.fetch_add(1, std::memory_order_relaxed);
    return at < chunks_ && !is_stopped(at);
  }

  /// Runs chunk `c`; false when it failed, or the rest is cancelled.
  bool run(std::size_t c) {
    std::exception_ptr error;
    try {
      const std::size_t begin = c * chunk_;
      call_(work_, begin, begin + std::min(chunk_, count_ - begin));
    } catch (...) {
      error = std::current_exception();
    }
    if (error) return fail(c, std::move(error));
    done_.fetch_add(1, std::memory_order_relaxed);
    return !is_stopped(c);
  }

  /// Stops all chunks because the callback threw `error`, which goes before what chunks throw.
  void interrupt(std::exception_ptr error) {
    if (!interruption_) interruption_ = std::move(error);
    limit_ = 0;
  }

  /// Rethrows what the callback threw, or else the earliest chunk. For the calling thread, after the others.
  void rethrow() const {
    if (interruption_) std::rethrow_exception(interruption_);
    if (error_) std::rethrow_exception(error_);
  }

 private:
  bool fail(std::size_t c, std::exception_ptr error) {
    const std::lock_guard lock(mutex_);
    if (error_ && failed_ < c) return false;
    std::swap(error_, error);
    failed_ = c;
    std::size_t limit = limit_;  // earlier chunks still run: one of them may fail as well
    while (c + 1 < limit && !limit_.compare_exchange_weak(limit, c + 1)) continue;
    return false;
  }

  const std::size_t count_, chunk_, chunks_;
  const void* const work_;
  const function call_;
  std::atomic<std::size_t> next_ = 0, done_ = 0;
  std::atomic<std::size_t> limit_ = std::numeric_limits<std::size_t>::max();
  std::mutex mutex_;
  std::exception_ptr error_, interruption_;  // the latter belongs to the calling thread
  std::size_t failed_ = 0;
};

}  // namespace globalmatch::detail

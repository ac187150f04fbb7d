// Objects that threads gather in: each is lent to one thread at a time.
#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace globalmatch::detail {

/// Lends objects for as long as a chunk is read: there are no more of them than threads, and what they gather
/// of many chunks lies in few large vectors, whose memory allocators give back at once.
template <class T>
class per_thread {
 public:
  /// One that no thread has, else `T(arguments...)`.
  template <class... Arguments>
  std::unique_ptr<T> take(const Arguments&... arguments) {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) return std::make_unique<T>(arguments...);
    std::unique_ptr<T> object = std::move(idle_.back());
    idle_.pop_back();
    return object;
  }
  void give_back(std::unique_ptr<T> object) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(object));
  }
  /// All, once every thread has given back its own.
  std::vector<std::unique_ptr<T>>& all() { return idle_; }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<T>> idle_;
};

}  // namespace globalmatch::detail

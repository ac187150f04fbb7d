// Internal to the LAZ reader: chunks that are decoded when they are asked for.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/threads.hpp"
#include "support/file_error.hpp"
#include "support/laz_layout.hpp"

namespace globalmatch::support::laz {

/// The last chunks that were decoded, a few more than there are threads. A thread that has to wait for a
/// chunk that another decodes meanwhile decodes one that follows. `Content` is what is kept of a chunk.
template <class Content>
class chunk_cache {
 public:
  using decode_function = std::function<void(const chunk&, Content&)>;

  chunk_cache(std::vector<chunk> chunks, int threads, decode_function decode_chunk)
      : chunks_(std::move(chunks)),
        decode_chunk_(std::move(decode_chunk)),
        threads_(static_cast<std::size_t>(detail::thread_count(execution{.threads = threads}))) {}

  /// Calls `use(content, begin, count, done)` for each piece of the points from number `first` on: those of a
  /// chunk from `begin` on, behind `done` others. May be called by several threads at once.
  template <class Use>
  void for_each_piece(std::size_t first, std::size_t size, const Use& use);

 private:
  struct entry {
    std::size_t index;
    std::shared_ptr<const Content> content;  ///< null while it is decoded
  };
  using iterator = typename std::list<entry>::iterator;

  std::shared_ptr<const Content> get(std::size_t index);
  void decode(std::size_t index, std::unique_lock<std::mutex>& lock);
  void decode_ahead(std::size_t index, std::unique_lock<std::mutex>& lock);
  void drop_oldest();
  iterator find(std::size_t index) {
    return std::find_if(entries_.begin(), entries_.end(), [&](const entry& e) { return e.index == index; });
  }

  std::vector<chunk> chunks_;
  decode_function decode_chunk_;
  std::size_t threads_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::list<entry> entries_;  // last used first
};

template <class Content>
template <class Use>
void chunk_cache<Content>::for_each_piece(std::size_t first, std::size_t size, const Use& use) {
  const auto behind = std::upper_bound(chunks_.begin(), chunks_.end(), first,
                                       [](std::size_t point, const chunk& c) { return point < c.first; });
  auto index = static_cast<std::size_t>(behind - chunks_.begin()) - 1;
  for (std::size_t done = 0; done < size; ++index) {
    const std::shared_ptr<const Content> content = get(index);
    const std::size_t begin = first + done - static_cast<std::size_t>(chunks_[index].first);
    const std::size_t count = std::min(size - done, static_cast<std::size_t>(chunks_[index].count) - begin);
    use(*content, begin, count, done);
    done += count;
  }
}

template <class Content>
std::shared_ptr<const Content> chunk_cache<Content>::get(std::size_t index) {
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto at = find(index);
    if (at == entries_.end()) {
      decode(index, lock);
    } else if (at->content) {
      entries_.splice(entries_.begin(), entries_, at);
      return at->content;
    } else {
      decode_ahead(index, lock);
      changed_.wait(lock, [&] {
        const auto wanted = find(index);
        return wanted == entries_.end() || wanted->content;
      });
    }
  }
}

// Unlocks while it decodes.
template <class Content>
void chunk_cache<Content>::decode(std::size_t index, std::unique_lock<std::mutex>& lock) {
  drop_oldest();
  entries_.push_front({index, nullptr});
  const auto at = entries_.begin();
  lock.unlock();
  const auto content = std::make_shared<Content>();
  try {
    decode_chunk_(chunks_[index], *content);
  } catch (...) {
    lock.lock();
    entries_.erase(at);
    changed_.notify_all();
    throw;
  }
  lock.lock();
  at->content = content;
  changed_.notify_all();
}

// Decodes one of the chunks that the threads will ask for next.
template <class Content>
void chunk_cache<Content>::decode_ahead(std::size_t index, std::unique_lock<std::mutex>& lock) {
  const std::size_t end = std::min(index + threads_, chunks_.size());
  for (std::size_t next = index + 1; next < end; ++next) {
    if (find(next) != entries_.end()) continue;
    try {
      decode(next, lock);
    } catch (const file_error&) {
      // which those get who ask for it
    }
    return;
  }
}

template <class Content>
void chunk_cache<Content>::drop_oldest() {
  const std::size_t most = threads_ + 2;
  for (auto at = entries_.end(); entries_.size() >= most && at != entries_.begin();)
    if ((--at)->content) at = entries_.erase(at);
}

}  // namespace globalmatch::support::laz

#include "support/laz_decoded_chunks.hpp"

#include <algorithm>
#include <utility>

#include "globalmatch/detail/core/threads.hpp"
#include "support/file_error.hpp"

namespace globalmatch::support::laz {

decoded_chunks::decoded_chunks(file_bytes file, const record_layout& layout, std::vector<chunk> chunks,
                               int threads)
    : file_(std::move(file)),
      chunks_(std::move(chunks)),
      decoders_(file_, layout),
      threads_(static_cast<std::size_t>(detail::thread_count(execution{.threads = threads}))) {}

void decoded_chunks::read(std::size_t first, std::span<raw_point> points, std::span<point_mark> marks) {
  const auto behind = std::upper_bound(chunks_.begin(), chunks_.end(), first,
                                       [](std::size_t point, const chunk& c) { return point < c.first; });
  auto index = static_cast<std::size_t>(behind - chunks_.begin()) - 1;
  for (std::size_t done = 0; done < points.size(); ++index) {
    const std::shared_ptr<const decoded> content = get(index);
    const std::size_t begin = first + done - static_cast<std::size_t>(chunks_[index].first);
    const std::size_t count = std::min(points.size() - done, content->points.size() - begin);
    std::copy_n(content->points.data() + begin, count, points.data() + done);
    std::copy_n(content->marks.data() + begin, count, marks.data() + done);
    done += count;
  }
}

std::shared_ptr<const decoded_chunks::decoded> decoded_chunks::get(std::size_t index) {
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
void decoded_chunks::decode(std::size_t index, std::unique_lock<std::mutex>& lock) {
  drop_oldest();
  entries_.push_front({index, nullptr});
  const auto at = entries_.begin();
  lock.unlock();
  const auto content = std::make_shared<decoded>();
  try {
    const auto count = static_cast<std::size_t>(chunks_[index].count);
    content->points.resize(count);
    content->marks.resize(count);
    decoders_.decode(chunks_[index], content->points, content->marks);
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
void decoded_chunks::decode_ahead(std::size_t index, std::unique_lock<std::mutex>& lock) {
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

std::list<decoded_chunks::entry>::iterator decoded_chunks::find(std::size_t index) {
  return std::find_if(entries_.begin(), entries_.end(), [&](const entry& e) { return e.index == index; });
}

void decoded_chunks::drop_oldest() {
  const std::size_t most = threads_ + 2;
  for (auto at = entries_.end(); entries_.size() >= most && at != entries_.begin();)
    if ((--at)->content) at = entries_.erase(at);
}

}  // namespace globalmatch::support::laz

// Internal to the LAZ reader: chunks that are decoded when they are asked for.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "support/file_bytes.hpp"
#include "support/las_points.hpp"
#include "support/laz_chunk_decoder.hpp"
#include "support/laz_layout.hpp"

namespace globalmatch::support::laz {

/// The last chunks that were decoded, a few more than there are threads. A thread that has to wait for a
/// chunk that another decodes meanwhile decodes one that follows.
class decoded_chunks {
 public:
  decoded_chunks(file_bytes file, const record_layout& layout, std::vector<chunk> chunks, int threads);

  /// Copies the points from number `first` on. May be called by several threads at once.
  void read(std::size_t first, std::span<raw_point> points, std::span<point_mark> marks);

 private:
  struct decoded {
    std::vector<raw_point> points;
    std::vector<point_mark> marks;
  };

  struct entry {
    std::size_t index;
    std::shared_ptr<const decoded> content;  ///< null while it is decoded
  };

  std::shared_ptr<const decoded> get(std::size_t index);
  void decode(std::size_t index, std::unique_lock<std::mutex>& lock);
  std::list<entry>::iterator find(std::size_t index);
  void decode_ahead(std::size_t index, std::unique_lock<std::mutex>& lock);
  void drop_oldest();

  file_bytes file_;
  std::vector<chunk> chunks_;
  chunk_decoders decoders_;
  std::size_t threads_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::list<entry> entries_;  // last used first
};

}  // namespace globalmatch::support::laz

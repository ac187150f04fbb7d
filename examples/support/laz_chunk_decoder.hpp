// Internal to the LAZ reader: chunks of a file become points.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "support/class_counts.hpp"
#include "support/file_bytes.hpp"
#include "support/las_points.hpp"
#include "support/laz_layout.hpp"

namespace globalmatch::support::laz {

/// Decodes one chunk after the other. What it allocates is kept for the next.
class chunk_decoder {
 public:
  chunk_decoder(const file_bytes& file, const record_layout& layout);
  ~chunk_decoder();

  /// Decodes coordinates and marks of all points of a chunk, and of their attributes no more than needed.
  /// Throws `file_error` when the chunk is damaged.
  void decode(const chunk& chunk, std::span<raw_point> points, std::span<point_mark> marks);

  /// Adds the return numbers and classes of all points of a chunk. Throws `file_error` when it is damaged.
  void count(const chunk& chunk, class_counts& counts);

  /// Decodes whole records, as files have them that are not compressed.
  void decode_records(const chunk& chunk, std::span<char> records);

  /// [bytes] of a chunk that starts at `offset` and holds `count` points of a format without layers.
  std::uint64_t size_of(std::uint64_t offset, std::uint64_t count);

 private:
  struct models;

  template <class Output>
  void decode_into(const chunk& chunk, const Output& output);
  std::uint64_t coordinates_size(const chunk& chunk);

  const file_bytes& file_;
  record_layout layout_;
  std::unique_ptr<models> models_;
};

/// Decoders that threads take and give back.
class chunk_decoders {
 public:
  chunk_decoders(const file_bytes& file, const record_layout& layout) : file_(file), layout_(layout) {}

  void decode(const chunk& chunk, std::span<raw_point> points, std::span<point_mark> marks);
  void count(const chunk& chunk, class_counts& counts);
  void decode_records(const chunk& chunk, std::span<char> records);

 private:
  template <class Work>
  void with_decoder(const Work& work);

  const file_bytes& file_;
  record_layout layout_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<chunk_decoder>> idle_;
};

}  // namespace globalmatch::support::laz

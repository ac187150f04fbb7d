// Internal to the LAS writer: compressed points.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <ostream>
#include <span>
#include <vector>

#include "support/laz_layout.hpp"

namespace globalmatch::support::laz {

/// Compresses one chunk after the other. What it allocates is kept for the next.
class chunk_encoder {
 public:
  explicit chunk_encoder(const record_layout& layout);
  ~chunk_encoder();

  /// Appends the chunk of these records, of which there must be one at least.
  void encode(std::span<const char> records, std::vector<char>& chunk);

 private:
  struct models;
  record_layout layout_;
  std::unique_ptr<models> models_;
};

/// Writes the points of a LAZ file, in chunks of `chunk_size` that are compressed in parallel. The bytes are
/// the same whatever the number of threads.
class chunk_writer {
 public:
  /// LASzip's own.
  static constexpr std::uint32_t chunk_size = 50'000;

  /// Writes from the current position of `out` on, which must be one that can be returned to.
  chunk_writer(std::ostream& out, const record_layout& layout, int threads);
  ~chunk_writer();

  /// Takes records, as a file has them that is not compressed.
  void write(std::span<const char> records);
  /// Writes what is left, and the table of chunks.
  void finish();

 private:
  struct job;

  void compress(std::size_t chunks);
  std::size_t chunk_bytes() const { return chunk_size * layout_.record_size(); }

  std::ostream& out_;
  record_layout layout_;
  int threads_;
  std::streampos begin_;
  std::vector<char> pending_;  // records that are not compressed yet
  std::vector<std::unique_ptr<job>> jobs_;
  std::vector<std::uint32_t> sizes_;  // [bytes] of chunks
};

}  // namespace globalmatch::support::laz

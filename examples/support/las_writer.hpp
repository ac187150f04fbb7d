// Internal to `write_scans`: LAS files, compressed or not.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <ostream>
#include <span>
#include <string>

#include "support/las_layout.hpp"
#include "support/laz_chunk_writer.hpp"

namespace globalmatch::support {

/// Writes point records behind a header that counts them.
class las_writer {
 public:
  /// Writes from the start of `out` on, which must be one that can be returned to.
  las_writer(std::ostream& out, const las_layout& layout, bool is_compressed, int threads);

  void write(std::span<const char> records);
  /// Writes what is left, and the header again, which then knows what the points are.
  void finish();

 private:
  void count(std::span<const char> records);
  std::string header() const;
  std::string variable_records() const;

  std::ostream& out_;
  const las_layout& layout_;
  bool is_compressed_;
  std::string variable_records_;
  std::unique_ptr<laz::chunk_writer> chunks_;
  std::uint64_t count_ = 0;
  std::array<std::uint64_t, 16> counts_by_return_ = {};
  std::array<std::int32_t, 3> min_, max_;
};

}  // namespace globalmatch::support

// Internal to the LAZ reader: where decoded points go.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "support/class_counts.hpp"
#include "support/las_points.hpp"

namespace globalmatch::support::laz {

/// Keeps coordinates and marks of points.
struct coordinates_output {
  static constexpr bool has_records = false, has_counts = false;
  raw_point* points;
  point_mark* marks;

  void put(std::size_t index, const raw_point& point, point_mark mark) const {
    points[index] = point;
    marks[index] = mark;
  }
};

/// Keeps nothing.
struct no_output {
  static constexpr bool has_records = false, has_counts = false;
  void put(std::size_t, const raw_point&, point_mark) const {}
};

/// Counts return numbers and classes, for which heights and marks are not decoded where they have layers.
struct counts_output {
  static constexpr bool has_records = false, has_counts = true;
  class_counts* counts;
};

/// Keeps whole records, as a file that is not compressed has them.
struct records_output {
  static constexpr bool has_records = true, has_counts = false;
  char* records;
  std::size_t record_size;

  char* record(std::size_t index) const { return records + index * record_size; }
};

/// Writes a number into a record. Returns where the next one goes.
template <class T>
char* put_little(char* at, T value) {
  std::memcpy(at, &value, sizeof(T));
  if constexpr (std::endian::native != std::endian::little) std::reverse(at, at + sizeof(T));
  return at + sizeof(T);
}

/// Adds in 32 bits, as encoders subtract.
inline std::int32_t wrapping_sum(std::int32_t a, std::int32_t b) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) + static_cast<std::uint32_t>(b));
}

inline std::int32_t wrapping_difference(std::int32_t a, std::int32_t b) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) - static_cast<std::uint32_t>(b));
}

}  // namespace globalmatch::support::laz

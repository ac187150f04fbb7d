// Internal to the readers: the number types of binary files.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace globalmatch::support {

enum class scalar { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

constexpr std::size_t size_of(scalar type) {
  switch (type) {
    case scalar::int8:
    case scalar::uint8:
      return 1;
    case scalar::int16:
    case scalar::uint16:
      return 2;
    case scalar::int32:
    case scalar::uint32:
    case scalar::float32:
      return 4;
    default:
      return 8;
  }
}

/// A number from unaligned bytes in the given byte order.
template <class T>
T load(const char* bytes, std::endian order) {
  char copy[sizeof(T)];
  std::memcpy(copy, bytes, sizeof(T));
  if (order != std::endian::native) std::reverse(copy, copy + sizeof(T));
  T value;
  std::memcpy(&value, copy, sizeof(T));
  return value;
}

inline double load(scalar type, const char* bytes, std::endian order) {
  switch (type) {
    case scalar::int8:
      return load<std::int8_t>(bytes, order);
    case scalar::uint8:
      return load<std::uint8_t>(bytes, order);
    case scalar::int16:
      return load<std::int16_t>(bytes, order);
    case scalar::uint16:
      return load<std::uint16_t>(bytes, order);
    case scalar::int32:
      return load<std::int32_t>(bytes, order);
    case scalar::uint32:
      return load<std::uint32_t>(bytes, order);
    case scalar::int64:
      return static_cast<double>(load<std::int64_t>(bytes, order));
    case scalar::uint64:
      return static_cast<double>(load<std::uint64_t>(bytes, order));
    case scalar::float32:
      return static_cast<double>(load<float>(bytes, order));
    default:
      return load<double>(bytes, order);
  }
}

}  // namespace globalmatch::support

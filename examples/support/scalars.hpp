// Internal to the readers: the number types of binary files.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace globalmatch::support {

enum class scalar { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

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

/// The number into unaligned bytes in the given byte order.
template <class T>
void store(T value, char* bytes, std::endian order) {
  std::memcpy(bytes, &value, sizeof(T));
  if (order != std::endian::native) std::reverse(bytes, bytes + sizeof(T));
}

/// Calls `use(T{})` for the type that `type` names, and returns what it returns.
template <class Use>
constexpr decltype(auto) visit_type(scalar type, const Use& use) {
  switch (type) {
    case scalar::int8:
      return use(std::int8_t());
    case scalar::uint8:
      return use(std::uint8_t());
    case scalar::int16:
      return use(std::int16_t());
    case scalar::uint16:
      return use(std::uint16_t());
    case scalar::int32:
      return use(std::int32_t());
    case scalar::uint32:
      return use(std::uint32_t());
    case scalar::int64:
      return use(std::int64_t());
    case scalar::uint64:
      return use(std::uint64_t());
    case scalar::float32:
      return use(float());
    default:
      return use(double());
  }
}

constexpr std::size_t size_of(scalar type) {
  return visit_type(type, []<class T>(T) { return sizeof(T); });
}

inline double load(scalar type, const char* bytes, std::endian order) {
  return visit_type(type, [&]<class T>(T) { return static_cast<double>(load<T>(bytes, order)); });
}

/// A little-endian number in the middle of a header or record.
template <class T>
T number_at(std::string_view bytes, std::size_t offset) {
  return load<T>(bytes.data() + offset, std::endian::little);
}

}  // namespace globalmatch::support

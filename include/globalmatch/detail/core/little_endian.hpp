// Numbers as bytes, the least significant first, whatever the order of the processor.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstring>

namespace globalmatch::detail {

template <class T>
concept plain_number = sizeof(T) <= 8 &&
                       ((std::integral<T> && !std::same_as<T, bool>) || std::floating_point<T>);

/// Writes the sizeof(T) bytes of a number; `bytes` need not be aligned.
template <plain_number T>
void store_little_endian(T value, char* bytes) {
  auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if constexpr (std::endian::native == std::endian::big) std::reverse(raw.begin(), raw.end());
  std::memcpy(bytes, raw.data(), sizeof(T));
}

/// Reads what `store_little_endian` wrote.
template <plain_number T>
T load_little_endian(const char* bytes) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), bytes, sizeof(T));
  if constexpr (std::endian::native == std::endian::big) std::reverse(raw.begin(), raw.end());
  return std::bit_cast<T>(raw);
}

}  // namespace globalmatch::detail

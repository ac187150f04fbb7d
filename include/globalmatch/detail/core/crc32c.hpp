// The checksum of stem map files, and of the pages of E57.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "globalmatch/detail/core/little_endian.hpp"

namespace globalmatch::detail {

/// [k][b]: the remainder of byte b with k zero bytes behind it. Eight bytes at a time take a table each.
inline constexpr auto crc32c_tables = [] {
  constexpr std::uint32_t reversed_polynomial = 0x82F63B78;
  std::array<std::array<std::uint32_t, 256>, 8> all{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t remainder = byte;
    for (int bit = 0; bit < 8; ++bit)
      remainder = (remainder >> 1) ^ ((remainder & 1) != 0 ? reversed_polynomial : 0);
    all[0][byte] = remainder;
  }
  for (std::size_t k = 1; k < 8; ++k)
    for (std::size_t byte = 0; byte < 256; ++byte)
      all[k][byte] = (all[k - 1][byte] >> 8) ^ all[0][all[k - 1][byte] & 0xFF];
  return all;
}();

/// CRC-32C (Castagnoli), as iSCSI (RFC 3720) and E57 have it.
inline std::uint32_t crc32c(std::span<const char> bytes) {
  std::uint32_t remainder = ~std::uint32_t(0);
  std::size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    const auto word = load_little_endian<std::uint64_t>(bytes.data() + i) ^ remainder;
    const auto of = [word](std::size_t k) { return crc32c_tables[7 - k][(word >> (8 * k)) & 0xFF]; };
    remainder = of(0) ^ of(1) ^ of(2) ^ of(3) ^ of(4) ^ of(5) ^ of(6) ^ of(7);
  }
  for (; i < bytes.size(); ++i)
    remainder =
        (remainder >> 8) ^ crc32c_tables[0][(remainder ^ static_cast<unsigned char>(bytes[i])) & 0xFF];
  return ~remainder;
}

}  // namespace globalmatch::detail

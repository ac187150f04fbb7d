// The checksums of E57 pages, without the code of the reader.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace globalmatch::support {

/// CRC-32C, bit by bit.
inline std::uint32_t slow_crc32c(std::string_view bytes) {
  std::uint32_t remainder = 0xFFFFFFFF;
  for (const char c : bytes) {
    remainder ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) remainder = remainder >> 1 ^ (remainder % 2 == 0 ? 0 : 0x82F63B78);
  }
  return ~remainder;
}

/// Makes the checksums fit whatever the pages hold.
inline void seal_pages(std::string& file) {
  for (std::size_t page = 0; page + 1024 <= file.size(); page += 1024) {
    const std::uint32_t checksum = slow_crc32c(std::string_view(file).substr(page, 1020));
    for (std::size_t i = 0; i < 4; ++i) file[page + 1020 + i] = static_cast<char>(checksum >> (24 - 8 * i));
  }
}

}  // namespace globalmatch::support

// Internal to the readers: the checksum of E57 pages.
#pragma once

#include <cstdint>
#include <span>

namespace globalmatch::support {

/// CRC-32C (Castagnoli), as iSCSI (RFC 3720) and E57 have it.
std::uint32_t crc32c(std::span<const char> bytes);

}  // namespace globalmatch::support

// Internal to the PCD reader: LZF, the compression of its binary_compressed files.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace globalmatch::support {

/// No LZF data grows by more than this: three bytes stand for at most 264.
constexpr std::size_t lzf_max_growth = 88;

/// The decompressed bytes; empty when `packed` is no LZF data that yields exactly `size` bytes.
std::optional<std::vector<char>> lzf_decompress(std::span<const char> packed, std::size_t size);

}  // namespace globalmatch::support

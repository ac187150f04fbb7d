#include "support/lzf.hpp"

namespace globalmatch::support {

// Each step starts with a control byte. Below 32 it announces a run of literal bytes; else its upper three
// bits are the length of a copy of earlier output, and its lower five, with one more byte, how far back that
// lies.
std::optional<std::vector<char>> lzf_decompress(std::span<const char> packed, std::size_t size) {
  std::vector<char> out;
  out.reserve(size);
  std::size_t at = 0;
  const auto next = [&]() -> std::size_t { return static_cast<unsigned char>(packed[at++]); };
  while (at < packed.size()) {
    const std::size_t control = next();
    if (control < 32) {
      const std::size_t length = control + 1;
      if (length > packed.size() - at || length > size - out.size()) return std::nullopt;
      const auto* first = packed.data() + at;
      out.insert(out.end(), first, first + length);
      at += length;
      continue;
    }
    const bool long_copy = control >> 5 == 7;
    if (packed.size() - at < (long_copy ? 2u : 1u)) return std::nullopt;
    const std::size_t length = (control >> 5) + 2 + (long_copy ? next() : 0);
    const std::size_t distance = ((control & 31) << 8) + next() + 1;
    if (distance > out.size() || length > size - out.size()) return std::nullopt;
    for (std::size_t k = 0; k < length; ++k) out.push_back(out[out.size() - distance]);
  }
  if (out.size() != size) return std::nullopt;
  return out;
}

}  // namespace globalmatch::support

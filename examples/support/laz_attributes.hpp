// Internal to the LAZ reader and writer: GPS times and colours, which all point formats code alike.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>

#include "support/laz_arithmetic.hpp"
#include "support/laz_integers.hpp"
#include "support/laz_points.hpp"
#include "support/scalars.hpp"

namespace globalmatch::support::laz {

/// Bytes that no compressor writes.
struct damaged_chunk : std::runtime_error {
  damaged_chunk() : std::runtime_error("damaged chunk of compressed points") {}
};

/// What is coded of a GPS time that follows a difference other than zero: by which multiple of it the time
/// changes, or what else it is.
struct time_symbols {
  static constexpr std::uint32_t max_multiple = 500, min_multiple = 510;  // the latter is -10
  static constexpr std::uint32_t unchanged = 511, full = 512;

  static std::size_t context_of(std::uint32_t symbol) {
    return symbol == 0              ? 7
           : symbol == 1            ? 1
           : symbol < 10            ? 2
           : symbol < max_multiple  ? 3
           : symbol == max_multiple ? 4
           : symbol < min_multiple  ? 5
                                    : 6;
  }

  static std::int32_t predicted_by(std::uint32_t symbol, std::int32_t difference) {
    const std::uint32_t factor = symbol <= max_multiple ? symbol : max_multiple - symbol;
    return static_cast<std::int32_t>(factor * static_cast<std::uint32_t>(difference));
  }
};

/// Times that follow each other.
struct time_sequence {
  std::uint64_t last;
  std::int32_t difference;
  std::int32_t extremes;  ///< differences that were not near a multiple of the last, one after the other

  /// Takes up a difference that was coded by a multiple.
  LAZ_INLINE void count(std::uint32_t symbol, std::int32_t new_difference) {
    if (symbol == 1) {
      extremes = 0;
    } else if (symbol == 0 || symbol == time_symbols::max_multiple || symbol == time_symbols::min_multiple) {
      if (++extremes > 3) {
        difference = new_difference;
        extremes = 0;
      }
    }
  }
};

/// GPS times, of which up to four sequences are interleaved: each has a last time and a last difference, as
/// integers of the same bits. Formats 0 to 5 have a symbol for times that do not change.
template <bool HasUnchanged>
class time_decoder : time_symbols {
 public:
  void reset(std::uint64_t first) {
    zero_.reset(HasUnchanged ? 6 : 5);
    multiple_.reset(HasUnchanged ? 516 : 515);
    corrections_.reset();
    std::fill_n(sequences_, 4, time_sequence{0, 0, 0});
    sequences_[0].last = first;
    current_ = newest_ = 0;
  }

  LAZ_INLINE std::uint64_t decode(arithmetic_decoder& in) {
    // An encoder changes the sequence once at most before it codes a time.
    for (int attempt = 0; attempt < 4; ++attempt) {
      const std::uint32_t change =
          sequences_[current_].difference == 0 ? decode_after_zero(in) : decode_multiple(in);
      if (change == 0) return sequences_[current_].last;
      current_ = (current_ + change) & 3;
    }
    throw damaged_chunk();
  }

 private:
  // The number of sequences to go on by; 0: the time was decoded.
  LAZ_INLINE std::uint32_t decode_after_zero(arithmetic_decoder& in) {
    time_sequence& s = sequences_[current_];
    const std::uint32_t symbol = in.decode(zero_) + !HasUnchanged;
    if (symbol == 1) {
      s.difference = corrections_.decode(in, 0, 0);
      s.extremes = 0;
      s.last += static_cast<std::uint64_t>(std::int64_t(s.difference));
    } else if (symbol == 2) {
      decode_full(in);
    }
    return symbol > 2 ? symbol - 2 : 0;
  }

  LAZ_INLINE std::uint32_t decode_multiple(arithmetic_decoder& in) {
    std::uint32_t symbol = in.decode(multiple_);
    if (!HasUnchanged && symbol >= unchanged) ++symbol;
    if (symbol < unchanged) {
      decode_difference(in, symbol);
    } else if (symbol == full) {
      decode_full(in);
    }
    return symbol > full ? symbol - full : 0;
  }

  LAZ_INLINE void decode_difference(arithmetic_decoder& in, std::uint32_t symbol) {
    time_sequence& s = sequences_[current_];
    const std::int32_t difference =
        corrections_.decode(in, predicted_by(symbol, s.difference), context_of(symbol));
    s.last += static_cast<std::uint64_t>(std::int64_t(difference));
    s.count(symbol, difference);
  }

  LAZ_INLINE void decode_full(arithmetic_decoder& in) {
    const auto upper = static_cast<std::int32_t>(sequences_[current_].last >> 32);
    const auto decoded = static_cast<std::uint32_t>(corrections_.decode(in, upper, 8));
    const std::uint32_t lower = in.decode_bits(16);
    newest_ = (newest_ + 1) & 3;
    current_ = newest_;
    sequences_[current_] = {std::uint64_t(decoded) << 32 | in.decode_bits(16) << 16 | lower, 0, 0};
  }

  std::uint32_t current_, newest_;
  time_sequence sequences_[4];
  symbol_model<6> zero_;
  symbol_model<516> multiple_;
  integer_decoder<32, 9> corrections_;
};

struct color {
  std::uint16_t red, green, blue;

  static color load_from(const char* bytes) {
    const auto at = [&](std::size_t offset) {
      return load<std::uint16_t>(bytes + offset, std::endian::little);
    };
    return {at(0), at(2), at(4)};
  }

  char* put(char* at) const {
    for (const std::uint16_t value : {red, green, blue}) at = put_little(at, value);
    return at;
  }
};

/// Colours byte by byte: which of the six changed, and by how much, where green and blue are predicted to
/// change as red did.
class color_decoder {
 public:
  void reset() {
    changed_.reset();
    differences_.reset();
  }

  LAZ_INLINE color decode(arithmetic_decoder& in, const color& last) {
    const std::uint32_t changed = in.decode(changed_);
    const int red_low = decode_byte(in, changed & 1, 0, low(last.red));
    const int red_high = decode_byte(in, changed & 2, 1, high(last.red));
    const std::uint16_t red = join(red_low, red_high);
    if (!(changed & 64)) return {red, red, red};
    int change = red_low - low(last.red);
    const int green_low = decode_moved(in, changed & 4, 2, low(last.green), change);
    change = (change + green_low - low(last.green)) / 2;
    const int blue_low = decode_moved(in, changed & 16, 4, low(last.blue), change);
    change = red_high - high(last.red);
    const int green_high = decode_moved(in, changed & 8, 3, high(last.green), change);
    change = (change + green_high - high(last.green)) / 2;
    const int blue_high = decode_moved(in, changed & 32, 5, high(last.blue), change);
    return {red, join(green_low, green_high), join(blue_low, blue_high)};
  }

 private:
  static int low(std::uint16_t value) { return value & 0xFF; }
  static int high(std::uint16_t value) { return value >> 8; }
  static std::uint16_t join(int low, int high) { return static_cast<std::uint16_t>(high << 8 | low); }

  LAZ_INLINE int decode_byte(arithmetic_decoder& in, std::uint32_t is_changed, std::size_t model, int last) {
    if (!is_changed) return last;
    return (last + static_cast<int>(in.decode(differences_.get(model)))) & 0xFF;
  }

  LAZ_INLINE int decode_moved(arithmetic_decoder& in, std::uint32_t is_changed, std::size_t model, int last,
                              int by) {
    if (!is_changed) return last;
    return decode_byte(in, 1, model, std::clamp(last + by, 0, 255));
  }

  symbol_model<128> changed_;
  lazy_models<256, 6> differences_;
};

}  // namespace globalmatch::support::laz

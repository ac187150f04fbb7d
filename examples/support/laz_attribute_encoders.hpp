// Internal to the LAZ writer: GPS times and colours, which all point formats code alike.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "support/laz_arithmetic_encoder.hpp"
#include "support/laz_attributes.hpp"

namespace globalmatch::support::laz {

/// GPS times as `time_decoder` decodes them.
template <bool HasUnchanged>
class time_encoder : time_symbols {
 public:
  void reset(std::uint64_t first) {
    zero_.reset(HasUnchanged ? 6 : 5);
    multiple_.reset(HasUnchanged ? 516 : 515);
    corrections_.reset();
    std::fill_n(sequences_, 4, time_sequence{0, 0, 0});
    sequences_[0].last = first;
    current_ = newest_ = 0;
  }

  LAZ_INLINE void encode(arithmetic_encoder& out, std::uint64_t time) {
    const std::uint64_t difference = time - sequences_[current_].last;
    if (HasUnchanged && difference == 0) return encode_symbol(out, 0, unchanged);
    if (!is_near(difference)) return encode_far(out, time);
    encode_near(out, static_cast<std::int32_t>(difference));
    sequences_[current_].last = time;
  }

 private:
  static bool is_near(std::uint64_t difference) {
    const auto signed_difference = static_cast<std::int64_t>(difference);
    return signed_difference == static_cast<std::int32_t>(signed_difference);
  }

  // The symbol of the model that is used after a difference of zero, or that of the other.
  LAZ_INLINE void encode_symbol(arithmetic_encoder& out, std::uint32_t after_zero, std::uint32_t multiple) {
    if (sequences_[current_].difference == 0)
      out.encode(zero_, after_zero - !HasUnchanged);
    else
      out.encode(multiple_, multiple - (!HasUnchanged && multiple > unchanged));
  }

  // Of another sequence, or the first of one.
  LAZ_NOINLINE void encode_far(arithmetic_encoder& out, std::uint64_t time) {
    for (std::uint32_t change = 1; change < 4; ++change) {
      const std::uint32_t other = (current_ + change) & 3;
      if (!is_near(time - sequences_[other].last)) continue;
      encode_symbol(out, change + 2, full + change);
      current_ = other;
      return encode(out, time);
    }
    encode_symbol(out, 2, full);
    const auto upper = static_cast<std::int32_t>(sequences_[current_].last >> 32);
    corrections_.encode(out, upper, static_cast<std::int32_t>(time >> 32), 8);
    out.encode_bits(static_cast<std::uint32_t>(time), 32);
    newest_ = (newest_ + 1) & 3;
    current_ = newest_;
    sequences_[current_] = {time, 0, 0};
  }

  LAZ_INLINE void encode_near(arithmetic_encoder& out, std::int32_t difference) {
    time_sequence& s = sequences_[current_];
    if (s.difference == 0) {
      encode_symbol(out, 1, 0);
      corrections_.encode(out, 0, difference, 0);
      s.difference = difference;
      s.extremes = 0;
      return;
    }
    const std::uint32_t symbol = symbol_of_multiple(difference, s.difference);
    encode_symbol(out, 0, symbol);
    corrections_.encode(out, predicted_by(symbol, s.difference), difference, context_of(symbol));
    s.count(symbol, difference);
  }

  static std::uint32_t symbol_of_multiple(std::int32_t difference, std::int32_t last) {
    const double quotient = std::clamp(static_cast<double>(difference) / last, -10.0, 500.0);
    const auto multiple = static_cast<int>(quotient + (quotient < 0 ? -0.5 : 0.5));
    return static_cast<std::uint32_t>(multiple < 0 ? int(max_multiple) - multiple : multiple);
  }

  std::uint32_t current_, newest_;
  time_sequence sequences_[4];
  encoder_model<6> zero_;
  encoder_model<516> multiple_;
  integer_encoder<32, 9> corrections_;
};

/// Colours as `color_decoder` decodes them.
class color_encoder {
 public:
  void reset() {
    changed_.reset();
    differences_.reset();
  }

  LAZ_INLINE void encode(arithmetic_encoder& out, const color& last, const color& next) {
    const std::uint32_t changed = changes(last, next);
    out.encode(changed_, changed);
    encode_byte(out, changed & 1, 0, low(last.red), low(next.red));
    encode_byte(out, changed & 2, 1, high(last.red), high(next.red));
    if (!(changed & 64)) return;
    int change = low(next.red) - low(last.red);
    encode_moved(out, changed & 4, 2, low(last.green), low(next.green), change);
    change = (change + low(next.green) - low(last.green)) / 2;
    encode_moved(out, changed & 16, 4, low(last.blue), low(next.blue), change);
    change = high(next.red) - high(last.red);
    encode_moved(out, changed & 8, 3, high(last.green), high(next.green), change);
    change = (change + high(next.green) - high(last.green)) / 2;
    encode_moved(out, changed & 32, 5, high(last.blue), high(next.blue), change);
  }

 private:
  static int low(std::uint16_t value) { return value & 0xFF; }
  static int high(std::uint16_t value) { return value >> 8; }

  // Which bytes changed, and whether the colour is other than grey.
  static std::uint32_t changes(const color& last, const color& next) {
    const bool is_grey = next.red == next.green && next.red == next.blue;
    const auto of = [](std::uint16_t a, std::uint16_t b) {
      return std::uint32_t(low(a) != low(b)) | std::uint32_t(high(a) != high(b)) << 1;
    };
    return of(last.red, next.red) | of(last.green, next.green) << 2 | of(last.blue, next.blue) << 4 |
           std::uint32_t(!is_grey) << 6;
  }

  LAZ_INLINE void encode_byte(arithmetic_encoder& out, std::uint32_t is_changed, std::size_t model,
                              int predicted, int value) {
    if (is_changed)
      out.encode(differences_.get(model), static_cast<std::uint32_t>(value - predicted) & 0xFFu);
  }

  LAZ_INLINE void encode_moved(arithmetic_encoder& out, std::uint32_t is_changed, std::size_t model, int last,
                               int value, int by) {
    encode_byte(out, is_changed, model, std::clamp(last + by, 0, 255), value);
  }

  encoder_model<128> changed_;
  encoder_models<256, 6> differences_;
};

}  // namespace globalmatch::support::laz

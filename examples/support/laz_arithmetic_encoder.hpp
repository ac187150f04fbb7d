// Internal to the LAZ writer: the adaptive arithmetic coding of LASzip, encoded.
//
// Learned from the sources of LASzip (rapidlasso), laz-perf (Hobu) and laz-rs (Thomas Montaigu), all under
// the Apache License 2.0. The coder is that of Amir Said, "Introduction to Arithmetic Coding" (HPL-2004-76).
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "support/laz_arithmetic.hpp"
#include "support/laz_integers.hpp"

namespace globalmatch::support::laz {

template <std::uint32_t Capacity>
using encoder_model = symbol_model<Capacity, false>;
template <std::uint32_t Capacity, std::size_t Count>
using encoder_models = lazy_models<Capacity, Count, false>;

/// Bytes from symbols. What it allocates is kept for the next bytes.
class arithmetic_encoder {
 public:
  /// Forgets the bytes so far.
  void begin() {
    at_ = 0;
    low_ = 0;
    length_ = 0xFFFFFFFF;
  }

  template <std::uint32_t Capacity>
  LAZ_INLINE void encode(encoder_model<Capacity>& model, std::uint32_t symbol) {
    using symbols = encoder_model<Capacity>;
    auto* part = model.parts_ + symbol;
    const std::uint32_t unit = length_ >> symbols::unit_bits;
    const std::uint32_t begin = part->begin * unit;
    // The last symbol has what is left by the division, too.
    length_ = symbol + 1 == model.symbols_ ? length_ - begin : part[1].begin * unit - begin;
    advance(begin);
    ++part->count;
    if (--model.until_update_ == 0) model.update();
  }

  LAZ_INLINE void encode(bit_model& model, bool one) {
    const std::uint32_t zero = model.probability_ * (length_ >> bit_model::probability_bits);
    length_ = one ? length_ - zero : zero;
    advance(one ? zero : 0);
    model.count(one);
  }

  /// `count` bits, 1 to 32.
  LAZ_INLINE void encode_bits(std::uint32_t bits, unsigned count) {
    if (count > 19) {
      encode_few_bits(bits & 0xFFFFu, 16);
      bits >>= 16;
      count -= 16;
    }
    encode_few_bits(bits, count);
  }

  /// Ends the bytes such that decoders, which read four ahead, find all of the last symbol. Returns them;
  /// they stay until `begin`.
  std::span<const char> finish();

 private:
  static constexpr std::uint32_t min_length = 1u << 24;
  static constexpr std::size_t max_bytes = 8;  // of a symbol and of the end

  LAZ_INLINE void encode_few_bits(std::uint32_t bits, unsigned count) {
    length_ >>= count;
    advance(bits * length_);
  }

  // Moves the low end of the interval, and gives out the bytes that are settled by now.
  LAZ_INLINE void advance(std::uint32_t by) {
    low_ += by;
    if (low_ < by) carry();
    if (length_ < min_length) renormalize();
  }

  LAZ_NOINLINE void carry() {
    std::size_t at = at_;
    while (bytes_[--at] == static_cast<char>(0xFF)) bytes_[at] = 0;
    bytes_[at] = static_cast<char>(bytes_[at] + 1);
  }

  LAZ_INLINE void renormalize() {
    if (bytes_.size() - at_ < max_bytes) grow();
    do {
      bytes_[at_++] = static_cast<char>(low_ >> 24);
      low_ <<= 8;
      length_ <<= 8;
    } while (length_ < min_length);
  }

  LAZ_NOINLINE void grow() { bytes_.resize(2 * bytes_.size() + 4096); }

  std::vector<char> bytes_;
  std::size_t at_ = 0;
  std::uint32_t low_ = 0;  // of the interval
  std::uint32_t length_ = 0xFFFFFFFF;
};

inline std::span<const char> arithmetic_encoder::finish() {
  const bool is_long = length_ > 2 * min_length;
  length_ = is_long ? min_length >> 1 : min_length >> 9;  // one byte more, or two
  const std::uint32_t by = is_long ? min_length : min_length >> 1;
  advance(by);
  if (bytes_.size() - at_ < max_bytes) grow();
  for (int i = 0; i < 2 + is_long; ++i) bytes_[at_++] = 0;
  return {bytes_.data(), at_};
}

/// Encodes integers of `Bits` bits, as `integer_decoder` decodes them.
template <unsigned Bits, std::size_t Contexts>
class integer_encoder {
 public:
  void reset() {
    lengths_.reset();
    uppers_.reset();
    one_.reset();
    length_ = 0;
  }

  LAZ_INLINE void encode(arithmetic_encoder& out, std::int32_t predicted, std::int32_t value,
                         std::size_t context = 0) {
    const std::uint32_t difference =
        static_cast<std::uint32_t>(value) - static_cast<std::uint32_t>(predicted);
    // As a number of `Bits` bits with a sign.
    const auto correction = static_cast<std::int32_t>(difference << (32 - Bits)) >> (32 - Bits);
    encode_correction(out, correction, context);
  }

  /// The number of bits of the last correction.
  std::uint32_t length() const { return length_; }

 private:
  static constexpr unsigned upper_bits = 8;

  // Numbers of k bits are those from -(2^k - 1) to -2^(k - 1), and from 2^(k - 1) + 1 to 2^k.
  LAZ_INLINE void encode_correction(arithmetic_encoder& out, std::int32_t correction, std::size_t context) {
    const auto bits = static_cast<std::uint32_t>(correction);
    const std::uint32_t magnitude = correction <= 0 ? 0u - bits : bits - 1;
    length_ = static_cast<std::uint32_t>(std::bit_width(magnitude));
    out.encode(lengths_.get(context), length_);
    if (length_ == 0) return out.encode(one_, correction != 0);
    if (length_ == 32) return;
    const std::uint32_t c = correction < 0 ? bits + (1u << length_) - 1 : bits - 1;
    if (length_ <= upper_bits) return out.encode(uppers_.get(length_ - 1, 1u << length_), c);
    const unsigned lower_bits = length_ - upper_bits;
    out.encode(uppers_.get(length_ - 1), c >> lower_bits);
    out.encode_bits(c & ((1u << lower_bits) - 1), lower_bits);
  }

  std::uint32_t length_;
  bit_model one_;
  encoder_models<Bits + 1, Contexts> lengths_;
  encoder_models<1u << upper_bits, std::min(Bits, 31u)> uppers_;
};

}  // namespace globalmatch::support::laz

// Internal to the LAZ reader and writer: integers that are coded as corrections of predictions.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "support/laz_arithmetic.hpp"

namespace globalmatch::support::laz {

/// Models that are reset when they are first used after a `reset` of all: most chunks use few.
template <std::uint32_t Capacity, std::size_t Count, bool HasTable = true>
class lazy_models {
 public:
  void reset() { ++epoch_; }

  LAZ_INLINE symbol_model<Capacity, HasTable>& get(std::size_t index, std::uint32_t symbols = Capacity) {
    symbol_model<Capacity, HasTable>& model = models_[index];
    if (model.epoch != epoch_) {
      model.epoch = epoch_;
      model.reset(symbols);
    }
    return model;
  }

 private:
  std::uint32_t epoch_ = 0;
  symbol_model<Capacity, HasTable> models_[Count];
};

/// Decodes integers of `Bits` bits. What is coded first is the number of bits of the correction, with a model
/// for each of the contexts; then its upper 8 bits, with a model for each number of bits; then the rest.
template <unsigned Bits, std::size_t Contexts>
class integer_decoder {
 public:
  void reset() {
    lengths_.reset();
    uppers_.reset();
    one_.reset();
    length_ = 0;
  }

  LAZ_INLINE std::int32_t decode(arithmetic_decoder& from, std::int32_t predicted, std::size_t context = 0) {
    arithmetic_decoder in = from;
    length_ = in.decode(lengths_.get(context));
    const std::uint32_t value = static_cast<std::uint32_t>(predicted) + correction(in);
    from = in;
    return static_cast<std::int32_t>(Bits < 32 ? value & ((std::uint64_t(1) << Bits) - 1) : value);
  }

  /// The number of bits of the last correction.
  std::uint32_t length() const { return length_; }

 private:
  static constexpr unsigned upper_bits = 8;

  LAZ_INLINE std::uint32_t correction(arithmetic_decoder& in) {
    const std::uint32_t length = length_;
    if (length == 0) return in.decode(one_);
    std::uint32_t c;
    if (length <= upper_bits) {
      c = in.decode(uppers_.get(length - 1, 1u << length));
    } else {
      if (length == 32) return 0x80000000u;
      const unsigned lower_bits = length - upper_bits;
      c = in.decode(uppers_.get(length - 1)) << lower_bits;
      c |= in.decode_bits(lower_bits);
    }
    // The lower half of the numbers of k bits are those from -(2^k - 1), the upper those to 2^k.
    const std::uint32_t is_negative = ~c >> (length - 1) & 1u;
    return c + 1 - (is_negative << length);
  }

  std::uint32_t length_;
  bit_model one_;
  lazy_models<Bits + 1, Contexts> lengths_;
  lazy_models<1u << upper_bits, std::min(Bits, 31u)> uppers_;
};

/// The median of the last differences, of which the largest or the smallest of five is replaced in turn.
class running_median {
 public:
  void reset() {
    std::fill_n(sorted_, 5, 0);
    drops_largest_ = true;
  }

  std::int32_t get() const { return sorted_[2]; }

  LAZ_INLINE void add(std::int32_t value) {
    const std::int32_t median = sorted_[2];
    const std::int32_t* kept = sorted_ + 1 - drops_largest_;
    const std::int32_t a = kept[0], b = kept[1], c = kept[2], d = kept[3];
    drops_largest_ = (value < median) | ((value == median) & !drops_largest_);
    sorted_[0] = std::min(a, value);
    sorted_[1] = std::max(a, std::min(b, value));
    sorted_[2] = std::max(b, std::min(c, value));
    sorted_[3] = std::max(c, std::min(d, value));
    sorted_[4] = std::max(d, value);
  }

 private:
  std::int32_t sorted_[5];
  bool drops_largest_;
};

/// The number of bits of earlier corrections as a context: even, and at most `largest`.
inline std::uint32_t length_context(std::uint32_t length, std::uint32_t largest) {
  return std::min(length, largest) & ~1u;
}

}  // namespace globalmatch::support::laz

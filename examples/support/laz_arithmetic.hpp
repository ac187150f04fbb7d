// Internal to the LAZ reader: the adaptive arithmetic coding of LASzip, decoded.
//
// Learned from the sources of LASzip (rapidlasso), laz-perf (Hobu) and laz-rs (Thomas Montaigu), all under
// the Apache License 2.0. The coder is that of Amir Said, "Introduction to Arithmetic Coding" (HPL-2004-76).
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

namespace globalmatch::support::laz {

/// Bytes that may be read behind the end of what is decoded, whatever they are.
inline constexpr std::size_t padding = 8;

/// How often each of some symbols came so far, and what part of the interval each has. Nothing is initialised
/// before `reset`: a chunk uses few of its models.
template <std::uint32_t Capacity>
class symbol_model {
 public:
  void reset(std::uint32_t symbols = Capacity) {
    symbols_ = symbols;
    total_ = 0;
    cycle_ = symbols;
    std::fill_n(counts_, symbols, std::uint16_t(1));
    update();
    until_update_ = cycle_ = (symbols + 6) / 2;
  }

 private:
  friend class arithmetic_decoder;

  // The unit of the interval, and the counts above which all are halved.
  static constexpr unsigned unit_bits = 15;
  // A bucket of the interval begins with few symbols, mostly one, so that the search for one is short.
  static constexpr unsigned table_bits = Capacity <= 64 ? 7 : Capacity <= 256 ? 9 : 10;
  static constexpr unsigned bucket_bits = unit_bits - table_bits;
  static constexpr std::size_t buckets = std::size_t(1) << table_bits;
  using stored_symbol = std::conditional_t<(Capacity <= 256), std::uint8_t, std::uint16_t>;

  void count(std::uint32_t symbol) {
    ++counts_[symbol];
    if (--until_update_ == 0) update();
  }

#if defined(__GNUC__)
  [[gnu::noinline]]
#endif
  void
  update();

  // The interval is divided in parts of `length >> 15`, of which there are up to 63 more than 2^15.
  static constexpr std::size_t extra_buckets = 2;
  static constexpr std::size_t stride = 16;  // symbols that are stored at once

  std::uint32_t until_update_, cycle_, total_, symbols_;
  std::uint16_t counts_[Capacity];
  std::uint16_t begins_[Capacity + 1];  // of the parts of the interval; the end is beyond all
  stored_symbol firsts_[buckets + extra_buckets + stride];  // the symbol at the begin of each bucket
};

template <std::uint32_t Capacity>
void symbol_model<Capacity>::update() {
  total_ += cycle_;
  if (total_ > 1u << unit_bits) {
    total_ = 0;
    for (std::uint32_t k = 0; k < symbols_; ++k) {
      counts_[k] = static_cast<std::uint16_t>((counts_[k] + 1) / 2);
      total_ += counts_[k];
    }
  }
  const std::uint32_t scale = 0x80000000u / total_;
  std::uint32_t sum = 0;
  for (std::uint32_t k = 0; k < symbols_; ++k) {
    const std::uint32_t begin = scale * sum >> (31 - unit_bits);
    begins_[k] = static_cast<std::uint16_t>(begin);
    sum += counts_[k];
  }
  begins_[symbols_] = 0xFFFF;
  for (std::uint32_t k = 0; k < symbols_; ++k) {
    // Buckets that begin before the symbol are that of another; what is stored beyond its end is overwritten.
    const auto bucket_from = [](std::uint32_t begin) {
      return std::min<std::size_t>((begin + (1u << bucket_bits) - 1) >> bucket_bits, buckets + extra_buckets);
    };
    stored_symbol stored[stride];
    std::fill_n(stored, stride, static_cast<stored_symbol>(k));
    const std::size_t end = bucket_from(begins_[k + 1]);
    for (std::size_t at = bucket_from(begins_[k]); at < end; at += stride)
      std::memcpy(firsts_ + at, stored, sizeof(stored));
  }
  cycle_ = std::min(5 * cycle_ / 4, 8 * (symbols_ + 6));
  until_update_ = cycle_;
}

/// The same of two symbols.
class bit_model {
 public:
  void reset() {
    zeros_ = 1;
    total_ = 2;
    probability_ = 1u << (probability_bits - 1);
    cycle_ = until_update_ = 4;
  }

 private:
  friend class arithmetic_decoder;
  static constexpr unsigned probability_bits = 13;

  void count(bool one) {
    zeros_ += !one;
    if (--until_update_ == 0) update();
  }

  void update() {
    total_ += cycle_;
    if (total_ > 1u << probability_bits) {
      total_ = (total_ + 1) / 2;
      zeros_ = (zeros_ + 1) / 2;
      total_ += zeros_ == total_;
    }
    probability_ = zeros_ * (0x80000000u / total_) >> (31 - probability_bits);
    cycle_ = until_update_ = std::min(5 * cycle_ / 4, 64u);
  }

  std::uint32_t until_update_, cycle_, zeros_, total_;
  std::uint32_t probability_;  // of zero
};

/// Symbols from bytes. The state is small and copied to the registers of a loop. Behind the end of the bytes
/// it decodes whatever lies there, at most `padding` bytes further, and is overrun.
class arithmetic_decoder {
 public:
  arithmetic_decoder() = default;

  /// Decodes `bytes`, behind which `padding` more can be read.
  explicit arithmetic_decoder(std::span<const char> bytes)
      : at_(bytes.data()), limit_(bytes.data() + bytes.size() + 1), value_(next()), length_(0xFFFFFFFF) {
    advance(4);
  }

  /// Whether more was decoded than there are bytes.
  bool is_overrun() const { return at_ == limit_; }
  /// How many bytes from `begin` on were decoded.
  std::size_t position_from(const char* begin) const { return static_cast<std::size_t>(at_ - begin); }

  template <std::uint32_t Capacity>
  std::uint32_t decode(symbol_model<Capacity>& model) {
    using symbols = symbol_model<Capacity>;
    const std::uint32_t unit = length_ >> symbols::unit_bits;
    const std::uint32_t part = value_ / unit;
    std::uint32_t symbol = model.firsts_[part >> symbols::bucket_bits];
    while (model.begins_[symbol + 1] <= part) ++symbol;
    const std::uint32_t low = model.begins_[symbol] * unit;
    // The last symbol has what is left by the division, too.
    const std::uint64_t high =
        std::min<std::uint64_t>(std::uint64_t(model.begins_[symbol + 1]) * unit, length_);
    value_ -= low;
    length_ = static_cast<std::uint32_t>(high) - low;
    renormalize();
    model.count(symbol);
    return symbol;
  }

  std::uint32_t decode(bit_model& model) {
    const std::uint32_t zero = model.probability_ * (length_ >> bit_model::probability_bits);
    const bool one = value_ >= zero;
    value_ -= one ? zero : 0;
    length_ = one ? length_ - zero : zero;
    renormalize();
    model.count(one);
    return one;
  }

  /// `count` bits, 1 to 32, all of which are equally likely to be one.
  std::uint32_t decode_bits(unsigned count) {
    if (count <= 19) return decode_few_bits(count);
    const std::uint32_t low = decode_few_bits(16);
    return decode_few_bits(count - 16) << 16 | low;
  }

 private:
  std::uint32_t decode_few_bits(unsigned count) {
    length_ >>= count;
    const std::uint32_t bits = value_ / length_;
    value_ -= bits * length_;
    renormalize();
    return bits;
  }

  // The interval is kept longer than 2^24: whole bytes are appended to it and to the value.
  void renormalize() {
    constexpr std::uint32_t shortest = 1u << 24;
    if (length_ >= shortest) return;
    const auto bits = static_cast<unsigned>(std::countl_zero(length_)) & 24u;
    value_ = static_cast<std::uint32_t>(((std::uint64_t(value_) << 32 | next()) << bits) >> 32);
    length_ <<= bits;
    advance(bits / 8);
  }

  std::uint32_t next() const {
    unsigned char bytes[4];
    std::memcpy(bytes, at_, 4);
    return std::uint32_t(bytes[0]) << 24 | std::uint32_t(bytes[1]) << 16 | std::uint32_t(bytes[2]) << 8 |
           bytes[3];
  }

  void advance(unsigned count) {
    at_ += count;
    if (at_ > limit_) at_ = limit_;
  }

  const char* at_ = nullptr;
  const char* limit_ = nullptr;  // one byte behind the end
  std::uint32_t value_ = 0;      // less than the length of the interval
  std::uint32_t length_ = 0;
};

}  // namespace globalmatch::support::laz

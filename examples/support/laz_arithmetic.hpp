// Internal to the LAZ reader and writer: the adaptive arithmetic coding of LASzip, its models and its
// decoder.
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

// Decoders are small and their state is best kept in registers: compilers inline too little by themselves.
#if defined(__GNUC__)
#define LAZ_INLINE [[gnu::always_inline]] inline
#define LAZ_NOINLINE [[gnu::noinline]]
#else
#define LAZ_INLINE inline
#define LAZ_NOINLINE
#endif

namespace globalmatch::support::laz {

/// How often each of some symbols came so far, and what part of the interval each has. Nothing is initialised
/// before `reset`: a chunk uses few of its models. Only decoders search for symbols, in a table.
template <std::uint32_t Capacity, bool HasTable = true>
class symbol_model {
 public:
  LAZ_NOINLINE void reset(std::uint32_t symbols = Capacity) {
    symbols_ = symbols;
    total_ = 0;
    cycle_ = symbols;
    for (std::uint32_t k = 0; k < symbols; ++k) parts_[k].count = 1;
    update();
    until_update_ = cycle_ = (symbols + 6) / 2;
  }

  std::uint32_t epoch = 0;  ///< of `lazy_models`

 private:
  friend class arithmetic_decoder;
  friend class arithmetic_encoder;

  // The unit of the interval, and the counts above which all are halved.
  static constexpr unsigned unit_bits = 15;
  // A bucket of the interval begins with few symbols, mostly one, so that the search for one is short.
  static constexpr unsigned table_bits = Capacity <= 64 ? 7 : Capacity <= 256 ? 9 : 10;
  static constexpr unsigned bucket_bits = unit_bits - table_bits;
  static constexpr std::size_t buckets = std::size_t(1) << table_bits;
  using stored_symbol = std::conditional_t<(Capacity <= 256), std::uint8_t, std::uint16_t>;

  /// What a symbol has of the interval.
  struct part {
    std::uint16_t begin, count;
  };

  LAZ_NOINLINE void update();
  void fill_table();

  // The interval is divided in parts of `length >> 15`, of which there are up to 63 more than 2^15.
  static constexpr std::size_t extra_buckets = 2;
  static constexpr std::size_t stride = 16;  // symbols that are stored at once

  std::uint32_t until_update_, cycle_, total_, symbols_;
  part parts_[Capacity + 1];  // behind the last: where nothing begins
  // The symbol at the begin of each bucket.
  stored_symbol firsts_[HasTable ? buckets + extra_buckets + stride : 1];
};

template <std::uint32_t Capacity, bool HasTable>
void symbol_model<Capacity, HasTable>::update() {
  total_ += cycle_;
  if (total_ > 1u << unit_bits) {
    total_ = 0;
    for (std::uint32_t k = 0; k < symbols_; ++k) {
      parts_[k].count = static_cast<std::uint16_t>((parts_[k].count + 1) / 2);
      total_ += parts_[k].count;
    }
  }
  const std::uint32_t scale = 0x80000000u / total_;
  std::uint32_t sum = 0;
  for (std::uint32_t k = 0; k < symbols_; ++k) {
    parts_[k].begin = static_cast<std::uint16_t>(scale * sum >> (31 - unit_bits));
    sum += parts_[k].count;
  }
  parts_[symbols_].begin = 0xFFFF;
  if constexpr (HasTable) fill_table();
  cycle_ = std::min(5 * cycle_ / 4, 8 * (symbols_ + 6));
  until_update_ = cycle_;
}

template <std::uint32_t Capacity, bool HasTable>
void symbol_model<Capacity, HasTable>::fill_table() {
  for (std::uint32_t k = 0; k < symbols_; ++k) {
    // Buckets that begin before the symbol are that of another; what is stored beyond its end is overwritten.
    const auto bucket_from = [](std::uint32_t begin) {
      return std::min<std::size_t>((begin + (1u << bucket_bits) - 1) >> bucket_bits, buckets + extra_buckets);
    };
    stored_symbol stored[stride];
    std::fill_n(stored, stride, static_cast<stored_symbol>(k));
    const std::size_t end = bucket_from(parts_[k + 1].begin);
    for (std::size_t at = bucket_from(parts_[k].begin); at < end; at += stride)
      std::memcpy(firsts_ + at, stored, sizeof(stored));
  }
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
  friend class arithmetic_encoder;
  static constexpr unsigned probability_bits = 13;

  LAZ_INLINE void count(bool one) {
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

/// Symbols from bytes. The state is small, to be kept in registers.
class arithmetic_decoder {
 public:
  /// The most bytes that decoding a symbol or bits takes.
  static constexpr std::size_t max_bytes = 6;

  arithmetic_decoder() = default;

  /// Decodes `bytes`, behind which there must be `max_bytes` for each symbol that is decoded before the next
  /// call of `is_overrun`.
  explicit arithmetic_decoder(std::span<const char> bytes)
      : at_(bytes.data() + 4),
        end_(bytes.data() + bytes.size()),
        value_(std::min(next(bytes.data()), 0xFFFFFFFEu)),  // what is not less than the length is damaged
        length_(0xFFFFFFFF) {}

  /// Whether more was decoded than there are bytes.
  bool is_overrun() const { return at_ > end_; }
  /// How many bytes from `begin` on were decoded.
  std::size_t position_from(const char* begin) const { return static_cast<std::size_t>(at_ - begin); }

  template <std::uint32_t Capacity>
  LAZ_INLINE std::uint32_t decode(symbol_model<Capacity>& model) {
    using symbols = symbol_model<Capacity>;
    const std::uint32_t unit = length_ >> symbols::unit_bits;
    const std::uint32_t units = value_ / unit;
    auto* part = model.parts_ + model.firsts_[units >> symbols::bucket_bits];
    while (part[1].begin <= units) ++part;
    const std::uint32_t low = part->begin * unit;
    // The last symbol has what is left by the division, too.
    const std::uint64_t high = std::min<std::uint64_t>(std::uint64_t(part[1].begin) * unit, length_);
    value_ -= low;
    length_ = static_cast<std::uint32_t>(high) - low;
    renormalize();
    ++part->count;
    if (--model.until_update_ == 0) model.update();
    return static_cast<std::uint32_t>(part - model.parts_);
  }

  LAZ_INLINE std::uint32_t decode(bit_model& model) {
    const std::uint32_t zero = model.probability_ * (length_ >> bit_model::probability_bits);
    const bool one = value_ >= zero;
    value_ -= one ? zero : 0;
    length_ = one ? length_ - zero : zero;
    renormalize();
    model.count(one);
    return one;
  }

  /// `count` bits, 1 to 32, all of which are equally likely to be one.
  LAZ_INLINE std::uint32_t decode_bits(unsigned count) {
    if (count <= 19) return decode_few_bits(count);
    const std::uint32_t low = decode_few_bits(16);
    return decode_few_bits(count - 16) << 16 | low;
  }

 private:
  LAZ_INLINE std::uint32_t decode_few_bits(unsigned count) {
    length_ >>= count;
    const std::uint32_t bits = value_ / length_;
    value_ -= bits * length_;
    renormalize();
    return bits;
  }

  // Appends whole bytes to the interval and the value, until it is longer than 2^24.
  LAZ_INLINE void renormalize() {
    // By how many bits, without a branch that cannot be predicted.
    const auto bits = static_cast<unsigned>(std::countl_zero(length_ | 1u)) & 24u;
    value_ = static_cast<std::uint32_t>(((std::uint64_t(value_) << 32 | next(at_)) << bits) >> 32);
    length_ <<= bits;
    at_ += bits / 8;
  }

  static std::uint32_t next(const char* at) {
    unsigned char bytes[4];
    std::memcpy(bytes, at, 4);
    return std::uint32_t(bytes[0]) << 24 | std::uint32_t(bytes[1]) << 16 | std::uint32_t(bytes[2]) << 8 |
           bytes[3];
  }

  const char* at_ = nullptr;
  const char* end_ = nullptr;
  std::uint32_t value_ = 0;  // less than the length of the interval
  std::uint32_t length_ = 0;
};

}  // namespace globalmatch::support::laz

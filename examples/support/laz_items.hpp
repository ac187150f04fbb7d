// Internal to the LAZ reader: points of the formats 0 to 3, whose items are coded one after the other.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "support/laz_arithmetic.hpp"
#include "support/laz_attributes.hpp"
#include "support/laz_integers.hpp"
#include "support/laz_layout.hpp"
#include "support/laz_points.hpp"
#include "support/scalars.hpp"

namespace globalmatch::support::laz {

/// The 20 bytes that all records of the formats 0 to 5 start with.
struct point10 {
  raw_point position;
  std::uint16_t intensity;
  std::uint8_t returns;  ///< number of the return, number of returns (3 bits each), and two flags
  std::uint8_t class_byte;
  std::uint8_t scan_angle;
  std::uint8_t user_data;
  std::uint16_t source;

  static constexpr std::size_t size = 20;

  static point10 load_from(const char* bytes) {
    const auto at = [&]<class T>(T, std::size_t offset) {
      return load<T>(bytes + offset, std::endian::little);
    };
    return {{at(std::int32_t(), 0), at(std::int32_t(), 4), at(std::int32_t(), 8)},
            at(std::uint16_t(), 12),
            at(std::uint8_t(), 14),
            at(std::uint8_t(), 15),
            at(std::uint8_t(), 16),
            at(std::uint8_t(), 17),
            at(std::uint16_t(), 18)};
  }

  char* put(char* at) const {
    for (const std::int32_t coordinate : {position.x, position.y, position.z})
      at = put_little(at, coordinate);
    at = put_little(at, intensity);
    for (const std::uint8_t byte : {returns, class_byte, scan_angle, user_data}) at = put_little(at, byte);
    return put_little(at, source);
  }
};

/// What is coded of the item POINT10, version 2.
class point10_decoder {
 public:
  void reset(const point10& first) {
    last_ = first;
    last_.intensity = 0;
    changed_.reset();
    returns_.reset();
    classes_.reset();
    user_data_.reset();
    scan_angles_.reset();
    intensity_.reset();
    source_.reset();
    x_.reset();
    y_.reset();
    z_.reset();
    for (auto& median : x_medians_) median.reset();
    for (auto& median : y_medians_) median.reset();
    intensities_.fill(0);
    heights_.fill(0);
  }

  const point10& decode(arithmetic_decoder& in) {
    const std::uint32_t changed = in.decode(changed_);
    if (changed & 32) last_.returns = static_cast<std::uint8_t>(in.decode(returns_.get(last_.returns)));
    const unsigned number = last_.returns & 7u, of = last_.returns >> 3 & 7u;
    const std::size_t kind = return_kinds[of][number];
    if (changed) decode_attributes(in, changed, kind);
    decode_position(in, kind, number > of ? number - of : of - number, of == 1);
    return last_;
  }

 private:
  // Points of the same number of return and number of returns are alike. Compressors map the pairs that
  // make no sense to some kind, too.
  static constexpr std::uint8_t return_kinds[8][8] = {
      {15, 14, 13, 12, 11, 10, 9, 8},  {14, 0, 1, 3, 6, 10, 10, 9},    {13, 1, 2, 4, 7, 11, 11, 10},
      {12, 3, 4, 5, 8, 12, 12, 11},    {11, 6, 7, 8, 9, 13, 13, 12},   {10, 10, 11, 12, 13, 14, 14, 13},
      {9, 10, 11, 12, 13, 14, 15, 14}, {8, 9, 10, 11, 12, 13, 14, 15},
  };

  void decode_attributes(arithmetic_decoder& in, std::uint32_t changed, std::size_t kind) {
    if (changed & 16)
      intensities_[kind] = static_cast<std::uint16_t>(
          intensity_.decode(in, intensities_[kind], std::min<std::size_t>(kind, 3)));
    last_.intensity = intensities_[kind];
    if (changed & 8) last_.class_byte = static_cast<std::uint8_t>(in.decode(classes_.get(last_.class_byte)));
    if (changed & 4) {
      const std::size_t direction = last_.returns >> 6 & 1u;
      last_.scan_angle = static_cast<std::uint8_t>(last_.scan_angle + in.decode(scan_angles_.get(direction)));
    }
    if (changed & 2) last_.user_data = static_cast<std::uint8_t>(in.decode(user_data_.get(last_.user_data)));
    if (changed & 1) last_.source = static_cast<std::uint16_t>(source_.decode(in, last_.source));
  }

  void decode_position(arithmetic_decoder& in, std::size_t kind, std::size_t level, bool is_single) {
    raw_point& p = last_.position;
    const std::int32_t dx = x_.decode(in, x_medians_[kind].get(), is_single);
    x_medians_[kind].add(dx);
    p.x = wrapping_sum(p.x, dx);
    const std::int32_t dy =
        y_.decode(in, y_medians_[kind].get(), is_single + length_context(x_.length(), 20));
    y_medians_[kind].add(dy);
    p.y = wrapping_sum(p.y, dy);
    const std::uint32_t length = (x_.length() + y_.length()) / 2;
    p.z = z_.decode(in, heights_[level], is_single + length_context(length, 18));
    heights_[level] = p.z;
  }

  point10 last_;
  std::array<std::uint16_t, 16> intensities_;
  std::array<std::int32_t, 8> heights_;
  std::array<running_median, 16> x_medians_, y_medians_;
  symbol_model<64> changed_;
  integer_decoder<32, 2> x_;
  integer_decoder<32, 22> y_;
  integer_decoder<32, 20> z_;
  integer_decoder<16, 4> intensity_;
  integer_decoder<16, 1> source_;
  lazy_models<256, 2> scan_angles_;
  lazy_models<256, 256> returns_, classes_, user_data_;
};

/// Decodes chunks of the formats 0 to 3.
class item_decoder {
 public:
  /// Decodes `count` points from `bytes`, behind which `padding` more can be read. Returns how many bytes
  /// that took. Throws `damaged_chunk`.
  template <class Output>
  std::size_t decode(const record_layout& layout, std::span<const char> bytes, std::size_t count,
                     const Output& output) {
    const auto decode_with = [&]<bool HasTime, bool HasColor>(std::bool_constant<HasTime>,
                                                              std::bool_constant<HasColor>) {
      return decode_chunk<HasTime, HasColor>(layout, bytes, count, output);
    };
    constexpr std::true_type yes;
    constexpr std::false_type no;
    if (layout.has_color()) return layout.has_time() ? decode_with(yes, yes) : decode_with(no, yes);
    return layout.has_time() ? decode_with(yes, no) : decode_with(no, no);
  }

 private:
  template <bool HasTime, bool HasColor, class Output>
  std::size_t decode_chunk(const record_layout& layout, std::span<const char> bytes, std::size_t count,
                           const Output& output);

  point10_decoder point_;
  time_decoder<true> time_;
  color_decoder color_;
  std::vector<symbol_model<256>> extra_;
  std::vector<std::uint8_t> last_extra_;
};

template <bool HasTime, bool HasColor, class Output>
std::size_t item_decoder::decode_chunk(const record_layout& layout, std::span<const char> bytes,
                                       std::size_t count, const Output& output) {
  const std::size_t first_size = layout.record_size(), extra_bytes = layout.extra_bytes;
  if (bytes.size() < first_size) throw damaged_chunk();
  const char* first = bytes.data();
  point10 point = point10::load_from(first);
  first += point10::size;
  point_.reset(point);
  std::uint64_t time = 0;
  if constexpr (HasTime) {
    time = load<std::uint64_t>(first, std::endian::little);
    first += 8;
    time_.reset(time);
  }
  color rgb{};
  if constexpr (HasColor) {
    rgb = color::load_from(first);
    first += 6;
    color_.reset();
  }
  extra_.resize(extra_bytes);
  for (auto& model : extra_) model.reset();
  last_extra_.assign(first, first + extra_bytes);
  arithmetic_decoder in(bytes.subspan(first_size));
  for (std::size_t i = 0;;) {
    if constexpr (Output::has_records) {
      char* at = point.put(output.record(i));
      if constexpr (HasTime) at = put_little(at, time);
      if constexpr (HasColor) at = rgb.put(at);
      std::copy(last_extra_.begin(), last_extra_.end(), at);
    } else {
      output.put(i, point.position, mark_of_class_byte(point.class_byte));
    }
    if (++i == count) break;
    point = point_.decode(in);
    if constexpr (HasTime) time = time_.decode(in);
    if constexpr (HasColor) rgb = color_.decode(in, rgb);
    for (std::size_t k = 0; k < extra_bytes; ++k)
      last_extra_[k] = static_cast<std::uint8_t>(last_extra_[k] + in.decode(extra_[k]));
    if (in.is_overrun()) throw damaged_chunk();
  }
  return first_size + in.position_from(bytes.data() + first_size);
}

}  // namespace globalmatch::support::laz

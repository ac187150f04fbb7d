// Internal to the LAZ reader: points of the formats 0 to 3, whose items are coded one after the other.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "support/laz_arithmetic.hpp"
#include "support/laz_attributes.hpp"
#include "support/laz_integers.hpp"
#include "support/laz_layout.hpp"
#include "support/laz_points.hpp"
#include "support/laz_returns.hpp"
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

  /// The next point.
  LAZ_INLINE const point10& decode(arithmetic_decoder& in) {
    decode_attributes(in);
    decode_position(in);
    return last_;
  }

 private:
  LAZ_INLINE void decode_attributes(arithmetic_decoder& in);
  LAZ_INLINE void decode_position(arithmetic_decoder& in);

  point10 last_;
  std::uint32_t kind_, level_;  // of the point
  bool is_single_;
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

void point10_decoder::decode_attributes(arithmetic_decoder& in) {
  const std::uint32_t changed = in.decode(changed_);
  if (changed & 32) last_.returns = static_cast<std::uint8_t>(in.decode(returns_.get(last_.returns)));
  const unsigned number = last_.returns & 7u, count = last_.returns >> 3 & 7u;
  kind_ = kind_of_short(number, count);
  level_ = returns_left(number, count);
  is_single_ = count == 1;
  if (!changed) return;
  if (changed & 16)
    intensities_[kind_] = static_cast<std::uint16_t>(
        intensity_.decode(in, intensities_[kind_], std::min<std::size_t>(kind_, 3)));
  last_.intensity = intensities_[kind_];
  if (changed & 8) last_.class_byte = static_cast<std::uint8_t>(in.decode(classes_.get(last_.class_byte)));
  if (changed & 4) {
    const std::size_t direction = last_.returns >> 6 & 1u;
    last_.scan_angle = static_cast<std::uint8_t>(last_.scan_angle + in.decode(scan_angles_.get(direction)));
  }
  if (changed & 2) last_.user_data = static_cast<std::uint8_t>(in.decode(user_data_.get(last_.user_data)));
  if (changed & 1) last_.source = static_cast<std::uint16_t>(source_.decode(in, last_.source));
}

void point10_decoder::decode_position(arithmetic_decoder& in) {
  raw_point& p = last_.position;
  const std::int32_t dx = x_.decode(in, x_medians_[kind_].get(), is_single_);
  x_medians_[kind_].add(dx);
  p.x = wrapping_sum(p.x, dx);
  const std::int32_t dy =
      y_.decode(in, y_medians_[kind_].get(), is_single_ + length_context(x_.length(), 20));
  y_medians_[kind_].add(dy);
  p.y = wrapping_sum(p.y, dy);
  const std::uint32_t length = (x_.length() + y_.length()) / 2;
  p.z = z_.decode(in, heights_[level_], is_single_ + length_context(length, 18));
  heights_[level_] = p.z;
}

/// The models of a chunk.
struct item_models {
  point10_decoder point;
  time_decoder<true> time;
  color_decoder colors;
  std::vector<symbol_model<256>> extra;
  std::vector<std::uint8_t> last_extra;
};

/// Decodes a chunk of the formats 0 to 3.
template <bool HasTime, bool HasColor, class Output>
class item_chunk {
 public:
  /// Of `bytes`, behind which decoders can read on. Throws `damaged_chunk`.
  item_chunk(item_models& models, const record_layout& layout, std::span<const char> bytes, Output output)
      : models_(models), output_(output) {
    if (bytes.size() < layout.record_size()) throw damaged_chunk();
    const char* at = bytes.data();
    first_ = point10::load_from(at);
    models_.point.reset(first_);
    at += point10::size;
    if constexpr (HasTime) {
      time_ = load<std::uint64_t>(at, std::endian::little);
      models_.time.reset(time_);
      at += 8;
    }
    if constexpr (HasColor) {
      color_ = color::load_from(at);
      models_.colors.reset();
      at += 6;
    }
    models_.extra.resize(layout.extra_bytes);
    for (auto& model : models_.extra) model.reset();
    models_.last_extra.assign(at, at + layout.extra_bytes);
    bytes_ = bytes;
  }

  /// Decodes all points. Returns how many bytes they take. Throws `damaged_chunk`.
  std::size_t decode(std::size_t count) {
    put(0, first_);
    arithmetic_decoder in(
        bytes_.subspan(point10::size + 8 * HasTime + 6 * HasColor + models_.last_extra.size()));
    for (std::size_t i = 1; i < count; ++i) {
      const point10& point = models_.point.decode(in);
      if constexpr (HasTime) time_ = models_.time.decode(in);
      if constexpr (HasColor) color_ = models_.colors.decode(in, color_);
      for (std::size_t k = 0; k < models_.extra.size(); ++k)
        models_.last_extra[k] =
            static_cast<std::uint8_t>(models_.last_extra[k] + in.decode(models_.extra[k]));
      put(i, point);
      if (in.is_overrun()) throw damaged_chunk();
    }
    return in.position_from(bytes_.data());
  }

 private:
  LAZ_INLINE void put(std::size_t index, const point10& point) {
    if constexpr (Output::has_records) {
      char* at = point.put(output_.record(index));
      if constexpr (HasTime) at = put_little(at, time_);
      if constexpr (HasColor) at = color_.put(at);
      std::copy(models_.last_extra.begin(), models_.last_extra.end(), at);
    } else if constexpr (Output::has_counts) {
      output_.counts->add(point.returns & 7u, point.returns >> 3 & 7u, point.class_byte & 31u);
    } else {
      output_.put(index, point.position, mark_of_class_byte(point.class_byte));
    }
  }

  item_models& models_;
  Output output_;
  std::span<const char> bytes_;
  point10 first_;
  std::uint64_t time_ = 0;
  color color_{};
};

}  // namespace globalmatch::support::laz

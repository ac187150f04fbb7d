// Internal to the LAZ reader: points of the formats 6 to 8, each attribute of which is coded in a layer of
// its own. Coordinates and marks need the first four.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "support/laz_arithmetic.hpp"
#include "support/laz_attributes.hpp"
#include "support/laz_integers.hpp"
#include "support/laz_layout.hpp"
#include "support/laz_points.hpp"
#include "support/laz_returns.hpp"
#include "support/scalars.hpp"

namespace globalmatch::support::laz {

/// The 30 bytes that all records of the formats 6 to 10 start with.
struct point14 {
  raw_point position;
  std::uint16_t intensity;
  std::uint8_t return_number, return_count;
  std::uint8_t flags;  ///< four of the class, direction of the scan, edge of the flight line
  std::uint8_t channel;
  std::uint8_t class_number;
  std::uint8_t user_data;
  std::int16_t scan_angle;
  std::uint16_t source;
  std::uint64_t time;

  static constexpr std::size_t size = 30;

  static point14 load_from(const char* bytes);
  char* put(char* at) const;
  point_mark mark() const { return mark_of(class_number, (flags & 4u) != 0); }
  bool is_first() const { return return_number == 1; }
  bool is_last() const { return return_number >= return_count; }
};

inline point14 point14::load_from(const char* bytes) {
  const auto at = [&]<class T>(T, std::size_t offset) {
    return load<T>(bytes + offset, std::endian::little);
  };
  const unsigned returns = at(std::uint8_t(), 14), flags = at(std::uint8_t(), 15);
  point14 point;
  point.position = {at(std::int32_t(), 0), at(std::int32_t(), 4), at(std::int32_t(), 8)};
  point.intensity = at(std::uint16_t(), 12);
  point.return_number = returns & 15u;
  point.return_count = static_cast<std::uint8_t>(returns >> 4);
  point.flags = static_cast<std::uint8_t>((flags & 15u) | (flags >> 2 & 0x30u));
  point.channel = flags >> 4 & 3u;
  point.class_number = at(std::uint8_t(), 16);
  point.user_data = at(std::uint8_t(), 17);
  point.scan_angle = at(std::int16_t(), 18);
  point.source = at(std::uint16_t(), 20);
  point.time = at(std::uint64_t(), 22);
  return point;
}

inline char* point14::put(char* at) const {
  for (const std::int32_t coordinate : {position.x, position.y, position.z}) at = put_little(at, coordinate);
  at = put_little(at, intensity);
  at = put_little(at, static_cast<std::uint8_t>(return_count << 4 | return_number));
  at = put_little(at,
                  static_cast<std::uint8_t>((flags & 15u) | unsigned(channel) << 4 | (flags & 0x30u) << 2));
  at = put_little(at, class_number);
  at = put_little(at, user_data);
  at = put_little(at, scan_angle);
  at = put_little(at, source);
  return put_little(at, time);
}

/// A layer of a chunk; none when nothing changes in it or nobody wants it.
struct layer {
  arithmetic_decoder in;
  bool is_present = false;
};

/// What is coded of one scanner channel in the layers of an item POINT14. Each point is predicted from the
/// last one of its channel.
class channel_decoder {
 public:
  /// The channel begins as if `first` had been its last point.
  void reset(const point14& first);

  /// The last point.
  const point14& last() const { return last_; }
  void set_number(std::uint8_t channel) { last_.channel = channel; }

  /// Which values of the point change that follows `last()`: bits.
  LAZ_INLINE std::uint32_t decode_changes(arithmetic_decoder& in) {
    const std::size_t context = last_.is_first() + 2 * last_.is_last() + 4 * time_changed_;
    return in.decode(changes_.get(context));
  }

  /// The channel of the point that follows `last()`, if it changes.
  std::uint8_t decode_channel(arithmetic_decoder& in) {
    return static_cast<std::uint8_t>((last_.channel + in.decode(channel_) + 1) % 4);
  }

  // The parts of the next point of the channel, to be decoded in this order.
  LAZ_INLINE void decode_returns(arithmetic_decoder& in, std::uint32_t changes);
  LAZ_INLINE void decode_position(arithmetic_decoder& xy, layer& z);
  LAZ_INLINE void decode_class(layer& classes, layer& flags);
  void decode_attributes(layer (&layers)[point_layers], std::uint32_t changes);

 private:
  point14 last_;
  bool time_changed_, is_single_;
  std::uint32_t kind_, level_;  // of the last point
  std::array<std::int32_t, 8> heights_;
  std::array<running_median, 12> x_medians_, y_medians_;
  lazy_models<128, 8> changes_;
  symbol_model<3> channel_;
  lazy_models<16, 16> return_counts_, return_numbers_;
  symbol_model<13> return_steps_;
  integer_decoder<32, 2> x_;
  integer_decoder<32, 22> y_;
  integer_decoder<32, 20> z_;
  lazy_models<64, 64> flags_;
  lazy_models<256, 64> classes_, user_data_;
  std::array<std::uint16_t, 8> intensities_;
  integer_decoder<16, 4> intensity_;
  integer_decoder<16, 2> scan_angle_;
  integer_decoder<16, 1> source_;
  time_decoder<false> time_;
};

inline void channel_decoder::reset(const point14& first) {
  last_ = first;
  time_changed_ = false;
  heights_.fill(first.position.z);
  for (auto& median : x_medians_) median.reset();
  for (auto& median : y_medians_) median.reset();
  changes_.reset();
  channel_.reset();
  return_counts_.reset();
  return_numbers_.reset();
  return_steps_.reset();
  x_.reset();
  y_.reset();
  z_.reset();
  flags_.reset();
  classes_.reset();
  user_data_.reset();
  intensities_.fill(first.intensity);
  intensity_.reset();
  scan_angle_.reset();
  source_.reset();
  time_.reset(first.time);
}

void channel_decoder::decode_returns(arithmetic_decoder& in, std::uint32_t changes) {
  time_changed_ = (changes & 16) != 0;
  if (changes & 4)
    last_.return_count = static_cast<std::uint8_t>(in.decode(return_counts_.get(last_.return_count)));
  unsigned number = last_.return_number;
  switch (changes & 3) {
    case 1:
      number += 1;
      break;
    case 2:
      number += 15;
      break;
    case 3:
      number = time_changed_ ? in.decode(return_numbers_.get(number)) : number + in.decode(return_steps_) + 2;
      break;
  }
  number &= 15u;
  last_.return_number = static_cast<std::uint8_t>(number);
  const unsigned count = last_.return_count;
  kind_ = 2 * kind_of_long(number, count) + time_changed_;
  level_ = std::min(returns_left(number, count), 7u);
  is_single_ = count == 1;
}

void channel_decoder::decode_position(arithmetic_decoder& xy, layer& z) {
  raw_point& p = last_.position;
  const std::int32_t dx = x_.decode(xy, x_medians_[kind_].get(), is_single_);
  x_medians_[kind_].add(dx);
  p.x = wrapping_sum(p.x, dx);
  const std::int32_t dy =
      y_.decode(xy, y_medians_[kind_].get(), is_single_ + length_context(x_.length(), 20));
  y_medians_[kind_].add(dy);
  p.y = wrapping_sum(p.y, dy);
  if (!z.is_present) return;
  const std::uint32_t length = (x_.length() + y_.length()) / 2;
  p.z = z_.decode(z.in, heights_[level_], is_single_ + length_context(length, 18));
  heights_[level_] = p.z;
}

void channel_decoder::decode_class(layer& classes, layer& flags) {
  if (classes.is_present) {
    const bool is_single = last_.is_first() && last_.is_last();
    const std::size_t context = (last_.class_number & 31u) * 2 + is_single;
    last_.class_number = static_cast<std::uint8_t>(classes.in.decode(classes_.get(context)));
  }
  if (flags.is_present) last_.flags = static_cast<std::uint8_t>(flags.in.decode(flags_.get(last_.flags)));
}

inline void channel_decoder::decode_attributes(layer (&layers)[point_layers], std::uint32_t changes) {
  if (layers[intensity_layer].is_present) {
    const std::size_t context = 2 * last_.is_first() + last_.is_last();
    std::uint16_t& intensity = intensities_[2 * context + time_changed_];
    intensity = static_cast<std::uint16_t>(intensity_.decode(layers[intensity_layer].in, intensity, context));
    last_.intensity = intensity;
  }
  if (layers[scan_angle_layer].is_present && changes & 8)
    last_.scan_angle = static_cast<std::int16_t>(
        scan_angle_.decode(layers[scan_angle_layer].in, last_.scan_angle, time_changed_));
  if (layers[user_data_layer].is_present)
    last_.user_data =
        static_cast<std::uint8_t>(layers[user_data_layer].in.decode(user_data_.get(last_.user_data / 4u)));
  if (layers[source_layer].is_present && changes & 32)
    last_.source = static_cast<std::uint16_t>(source_.decode(layers[source_layer].in, last_.source));
  if (layers[time_layer].is_present && time_changed_) last_.time = time_.decode(layers[time_layer].in);
}

}  // namespace globalmatch::support::laz

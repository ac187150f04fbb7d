// Internal to the LAZ writer: points of the formats 6 to 8, each attribute of which is coded in a layer of
// its own.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "support/laz_arithmetic_encoder.hpp"
#include "support/laz_attribute_encoders.hpp"
#include "support/laz_layers.hpp"
#include "support/laz_layout.hpp"
#include "support/laz_returns.hpp"

namespace globalmatch::support::laz {

/// A layer that is written. One in which nothing changes is left out.
struct written_layer {
  arithmetic_encoder out;
  bool changes;

  void begin() {
    out.begin();
    changes = false;
  }
};
using point_layers_out = std::array<written_layer, point_layers>;

/// Encodes one scanner channel of the item POINT14, as `channel_decoder` decodes it.
class channel_encoder {
 public:
  /// The channel begins as if `first` had been its last point.
  void reset(const point14& first);

  const point14& last() const { return last_; }

  /// Which values change from the last point to the next one of this channel: bits.
  std::uint32_t changes_to(const point14& next) const;

  /// Encodes the changes to the next point, which may be of another channel.
  LAZ_INLINE void encode_changes(arithmetic_encoder& out, std::uint32_t changes, std::uint8_t channel) {
    const std::size_t context = last_.is_first() + 2 * last_.is_last() + 4 * time_changed_;
    out.encode(changes_.get(context), changes);
    if (changes & 64) out.encode(channel_, (channel + 3u - last_.channel) % 4);
  }

  /// Encodes the next point of the channel.
  LAZ_INLINE void encode(point_layers_out& layers, const point14& next, std::uint32_t changes) {
    time_changed_ = (changes & 16) != 0;
    encode_returns(layers[xy_layer].out, next, changes);
    encode_position(layers, next);
    encode_class(layers, next);
    encode_attributes(layers, next, changes);
    last_ = next;
  }

 private:
  LAZ_INLINE void encode_returns(arithmetic_encoder& out, const point14& next, std::uint32_t changes);
  LAZ_INLINE void encode_position(point_layers_out& layers, const point14& next);
  LAZ_INLINE void encode_class(point_layers_out& layers, const point14& next);
  LAZ_INLINE void encode_attributes(point_layers_out& layers, const point14& next, std::uint32_t changes);

  point14 last_;
  bool time_changed_;
  std::array<std::int32_t, 8> heights_;
  std::array<running_median, 12> x_medians_, y_medians_;
  encoder_models<128, 8> changes_;
  encoder_model<3> channel_;
  encoder_models<16, 16> return_counts_, return_numbers_;
  encoder_model<13> return_steps_;
  integer_encoder<32, 2> x_;
  integer_encoder<32, 22> y_;
  integer_encoder<32, 20> z_;
  encoder_models<64, 64> flags_;
  encoder_models<256, 64> classes_, user_data_;
  std::array<std::uint16_t, 8> intensities_;
  integer_encoder<16, 4> intensity_;
  integer_encoder<16, 2> scan_angle_;
  integer_encoder<16, 1> source_;
  time_encoder<false> time_;
};

inline void channel_encoder::reset(const point14& first) {
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

inline std::uint32_t channel_encoder::changes_to(const point14& next) const {
  const unsigned step = (next.return_number - last_.return_number) & 15u;
  return (step == 0    ? 0u
          : step == 1  ? 1u
          : step == 15 ? 2u
                       : 3u) |
         std::uint32_t(next.return_count != last_.return_count) << 2 |
         std::uint32_t(next.scan_angle != last_.scan_angle) << 3 |
         std::uint32_t(next.time != last_.time) << 4 | std::uint32_t(next.source != last_.source) << 5;
}

inline void channel_encoder::encode_returns(arithmetic_encoder& out, const point14& next,
                                            std::uint32_t changes) {
  if (changes & 4) out.encode(return_counts_.get(last_.return_count), next.return_count);
  if ((changes & 3) != 3) return;
  if (time_changed_)
    out.encode(return_numbers_.get(last_.return_number), next.return_number);
  else
    out.encode(return_steps_, (next.return_number - last_.return_number - 2) & 15u);
}

inline void channel_encoder::encode_position(point_layers_out& layers, const point14& next) {
  const unsigned number = next.return_number, count = next.return_count;
  const std::uint32_t kind = 2 * kind_of_long(number, count) + time_changed_;
  const std::uint32_t level = std::min(returns_left(number, count), 7u);
  const bool is_single = count == 1;
  const raw_point &p = next.position, &last = last_.position;
  arithmetic_encoder& xy = layers[xy_layer].out;
  const std::int32_t dx = wrapping_difference(p.x, last.x), dy = wrapping_difference(p.y, last.y);
  x_.encode(xy, x_medians_[kind].get(), dx, is_single);
  x_medians_[kind].add(dx);
  y_.encode(xy, y_medians_[kind].get(), dy, is_single + length_context(x_.length(), 20));
  y_medians_[kind].add(dy);
  const std::uint32_t length = (x_.length() + y_.length()) / 2;
  z_.encode(layers[z_layer].out, heights_[level], p.z, is_single + length_context(length, 18));
  heights_[level] = p.z;
  layers[z_layer].changes |= p.z != last.z;
}

inline void channel_encoder::encode_class(point_layers_out& layers, const point14& next) {
  // Decoders know the returns of the next point by now, and the class of the last one.
  const std::size_t context = (last_.class_number & 31u) * 2 + (next.is_first() && next.is_last());
  layers[class_layer].out.encode(classes_.get(context), next.class_number);
  layers[class_layer].changes |= next.class_number != last_.class_number;
  layers[flags_layer].out.encode(flags_.get(last_.flags), next.flags);
  layers[flags_layer].changes |= next.flags != last_.flags;
}

inline void channel_encoder::encode_attributes(point_layers_out& layers, const point14& next,
                                               std::uint32_t changes) {
  const std::size_t context = 2 * next.is_first() + next.is_last();
  std::uint16_t& intensity = intensities_[2 * context + time_changed_];
  intensity_.encode(layers[intensity_layer].out, intensity, next.intensity, context);
  intensity = next.intensity;
  layers[intensity_layer].changes |= next.intensity != last_.intensity;
  if (changes & 8)
    scan_angle_.encode(layers[scan_angle_layer].out, last_.scan_angle, next.scan_angle, time_changed_);
  layers[scan_angle_layer].changes |= (changes & 8) != 0;
  layers[user_data_layer].out.encode(user_data_.get(last_.user_data / 4u), next.user_data);
  layers[user_data_layer].changes |= next.user_data != last_.user_data;
  if (changes & 32) source_.encode(layers[source_layer].out, last_.source, next.source);
  layers[source_layer].changes |= (changes & 32) != 0;
  if (time_changed_) time_.encode(layers[time_layer].out, next.time);
  layers[time_layer].changes |= time_changed_;
}

}  // namespace globalmatch::support::laz

// Internal to the LAZ writer: points of the formats 0 to 3, whose items are coded one after the other.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "support/laz_arithmetic_encoder.hpp"
#include "support/laz_attribute_encoders.hpp"
#include "support/laz_items.hpp"
#include "support/laz_layout.hpp"
#include "support/laz_returns.hpp"
#include "support/scalars.hpp"

namespace globalmatch::support::laz {

/// Encodes the item POINT10, version 2, as `point10_decoder` decodes it.
class point10_encoder {
 public:
  void reset(const point10& first) {
    last_ = first;
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

  LAZ_INLINE void encode(arithmetic_encoder& out, const point10& point) {
    const unsigned number = point.returns & 7u, count = point.returns >> 3 & 7u;
    const std::uint32_t kind = kind_of_short(number, count);
    encode_attributes(out, point, kind);
    encode_position(out, point.position, kind, returns_left(number, count), count == 1);
    last_ = point;
  }

 private:
  LAZ_INLINE void encode_attributes(arithmetic_encoder& out, const point10& point, std::uint32_t kind) {
    const std::uint32_t changed = std::uint32_t(point.returns != last_.returns) << 5 |
                                  std::uint32_t(point.intensity != intensities_[kind]) << 4 |
                                  std::uint32_t(point.class_byte != last_.class_byte) << 3 |
                                  std::uint32_t(point.scan_angle != last_.scan_angle) << 2 |
                                  std::uint32_t(point.user_data != last_.user_data) << 1 |
                                  std::uint32_t(point.source != last_.source);
    out.encode(changed_, changed);
    if (changed & 32) out.encode(returns_.get(last_.returns), point.returns);
    if (changed & 16) {
      intensity_.encode(out, intensities_[kind], point.intensity, std::min<std::size_t>(kind, 3));
      intensities_[kind] = point.intensity;
    }
    if (changed & 8) out.encode(classes_.get(last_.class_byte), point.class_byte);
    if (changed & 4) {
      const std::size_t direction = point.returns >> 6 & 1u;
      out.encode(scan_angles_.get(direction), static_cast<std::uint8_t>(point.scan_angle - last_.scan_angle));
    }
    if (changed & 2) out.encode(user_data_.get(last_.user_data), point.user_data);
    if (changed & 1) source_.encode(out, last_.source, point.source);
  }

  LAZ_INLINE void encode_position(arithmetic_encoder& out, const raw_point& p, std::uint32_t kind,
                                  std::uint32_t level, bool is_single) {
    const std::int32_t dx = wrapping_difference(p.x, last_.position.x);
    x_.encode(out, x_medians_[kind].get(), dx, is_single);
    x_medians_[kind].add(dx);
    const std::int32_t dy = wrapping_difference(p.y, last_.position.y);
    y_.encode(out, y_medians_[kind].get(), dy, is_single + length_context(x_.length(), 20));
    y_medians_[kind].add(dy);
    const std::uint32_t length = (x_.length() + y_.length()) / 2;
    z_.encode(out, heights_[level], p.z, is_single + length_context(length, 18));
    heights_[level] = p.z;
  }

  point10 last_;
  std::array<std::uint16_t, 16> intensities_;
  std::array<std::int32_t, 8> heights_;
  std::array<running_median, 16> x_medians_, y_medians_;
  encoder_model<64> changed_;
  integer_encoder<32, 2> x_;
  integer_encoder<32, 22> y_;
  integer_encoder<32, 20> z_;
  integer_encoder<16, 4> intensity_;
  integer_encoder<16, 1> source_;
  encoder_models<256, 2> scan_angles_;
  encoder_models<256, 256> returns_, classes_, user_data_;
};

/// Encodes chunks of the formats 0 to 3. What it allocates is kept for the next chunk.
class item_chunk_encoder {
 public:
  explicit item_chunk_encoder(const record_layout& layout) : layout_(layout), extra_(layout.extra_bytes) {}

  /// Appends the chunk of these records, of which there must be one at least.
  template <bool HasTime, bool HasColor>
  void encode(std::span<const char> records, std::vector<char>& chunk) {
    const std::size_t size = layout_.record_size();
    const char* last = records.data();
    chunk.insert(chunk.end(), last, last + size);
    reset(last);
    for (const char* at = last + size; at != records.data() + records.size(); last = at, at += size) {
      point_.encode(out_, point10::load_from(at));
      std::size_t offset = point10::size;
      if constexpr (HasTime) {
        time_.encode(out_, load<std::uint64_t>(at + offset, std::endian::little));
        offset += 8;
      }
      if constexpr (HasColor) {
        colors_.encode(out_, color::load_from(last + offset), color::load_from(at + offset));
        offset += 6;
      }
      for (std::size_t k = 0; k < extra_.size(); ++k, ++offset)
        out_.encode(extra_[k], static_cast<std::uint8_t>(at[offset] - last[offset]));
    }
    const std::span<const char> bytes = out_.finish();
    chunk.insert(chunk.end(), bytes.begin(), bytes.end());
  }

 private:
  void reset(const char* first) {
    out_.begin();
    point_.reset(point10::load_from(first));
    time_.reset(layout_.has_time() ? load<std::uint64_t>(first + point10::size, std::endian::little) : 0);
    colors_.reset();
    for (auto& model : extra_) model.reset();
  }

  record_layout layout_;
  arithmetic_encoder out_;
  point10_encoder point_;
  time_encoder<true> time_;
  color_encoder colors_;
  std::vector<encoder_model<256>> extra_;
};

}  // namespace globalmatch::support::laz

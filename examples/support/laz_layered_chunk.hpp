// Internal to the LAZ reader: chunks of the formats 6 to 8.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "support/laz_layers.hpp"
#include "support/laz_layout.hpp"

namespace globalmatch::support::laz {

/// What is coded of one scanner channel in the layers of colours and extra bytes.
class channel_attributes {
 public:
  void reset(std::size_t extra_bytes) {
    color_.reset();
    infrared_changes_.reset();
    infrared_.reset();
    extra_.resize(extra_bytes);
    for (auto& model : extra_) model.reset();
  }

  color decode_color(arithmetic_decoder& in, const color& last) { return color_.decode(in, last); }

  std::uint16_t decode_infrared(arithmetic_decoder& in, std::uint16_t last) {
    const std::uint32_t changed = in.decode(infrared_changes_);
    unsigned low = last & 0xFFu, high = last >> 8u;
    if (changed & 1) low = (low + in.decode(infrared_.get(0))) & 0xFFu;
    if (changed & 2) high = (high + in.decode(infrared_.get(1))) & 0xFFu;
    return static_cast<std::uint16_t>(high << 8 | low);
  }

  std::uint8_t decode_extra(arithmetic_decoder& in, std::size_t index, std::uint8_t last) {
    return static_cast<std::uint8_t>(last + in.decode(extra_[index]));
  }

  color last_color;
  std::uint16_t last_infrared;
  std::vector<std::uint8_t> last_extra;

 private:
  color_decoder color_;
  symbol_model<4> infrared_changes_;
  lazy_models<256, 2> infrared_;
  std::vector<symbol_model<256>> extra_;
};

/// The layers of a chunk, one after the other.
class layer_reader {
 public:
  layer_reader(const record_layout& layout, std::span<const char> chunk)
      : sizes_(chunk.data() + layout.record_size() + 4), rest_(chunk.subspan(layout.header_size())) {}

  layer operator()() {
    const std::size_t size = load<std::uint32_t>(sizes_, std::endian::little);
    if (size > rest_.size()) throw damaged_chunk();
    const std::span<const char> bytes = rest_.first(size);
    sizes_ += 4;
    rest_ = rest_.subspan(size);
    return size > 0 ? layer{arithmetic_decoder(bytes), true} : layer{};
  }

 private:
  const char* sizes_;
  std::span<const char> rest_;
};

/// Decodes chunks of the formats 6 to 8.
class layered_decoder {
 public:
  /// Decodes `count` points from a chunk, behind which `padding` more bytes can be read. For coordinates it
  /// may end behind the layers that they need. Throws `damaged_chunk`.
  template <class Output>
  void decode(const record_layout& layout, std::span<const char> bytes, std::size_t count,
              const Output& output);

 private:
  void reset(const point14& first);
  void reset_attributes(const record_layout& layout, const char* record);
  void change_channel(std::uint8_t channel);
  void decode_attributes(const record_layout& layout, std::uint8_t channel);
  void put_record(const record_layout& layout, char* record) const;

  std::array<channel_decoder, 4> channels_;
  std::array<bool, 4> is_used_;
  std::uint8_t channel_;

  // The other items have channels of their own.
  std::array<channel_attributes, 4> attributes_;
  std::array<bool, 4> has_attributes_;
  std::uint8_t attribute_channel_;
  const channel_attributes* attributes_of_point_;
  std::vector<layer> attribute_layers_;
};

inline void layered_decoder::reset(const point14& first) {
  is_used_.fill(false);
  channel_ = first.channel;
  is_used_[channel_] = true;
  channels_[channel_].reset(first);
}

inline void layered_decoder::reset_attributes(const record_layout& layout, const char* record) {
  has_attributes_.fill(false);
  attribute_channel_ = channel_;
  has_attributes_[channel_] = true;
  channel_attributes& attributes = attributes_[channel_];
  const char* at = record + point14::size;
  attributes.last_color = layout.has_color() ? color::load_from(at) : color{};
  at += 6 * layout.has_color();
  attributes.last_infrared = layout.has_infrared() ? load<std::uint16_t>(at, std::endian::little) : 0;
  at += 2 * layout.has_infrared();
  attributes.last_extra.assign(at, at + layout.extra_bytes);
  attributes.reset(layout.extra_bytes);
  attributes_of_point_ = &attributes;
}

inline void layered_decoder::change_channel(std::uint8_t channel) {
  if (!is_used_[channel]) channels_[channel].reset(channels_[channel_].last());
  is_used_[channel] = true;
  channel_ = channel;
}

// Version 3 decodes a point whose channel changes from the last one of the old channel, unless the new one
// comes for the first time.
inline void layered_decoder::decode_attributes(const record_layout& layout, std::uint8_t channel) {
  channel_attributes* last = &attributes_[attribute_channel_];
  channel_attributes& models = attributes_[channel];
  if (channel != attribute_channel_) {
    attribute_channel_ = channel;
    if (!has_attributes_[channel]) {
      models.last_color = last->last_color;
      models.last_infrared = last->last_infrared;
      models.last_extra = last->last_extra;
      models.reset(layout.extra_bytes);
      has_attributes_[channel] = true;
      last = &models;
    } else if (layout.version >= 4) {
      last = &models;
    }
  }
  layer* next = attribute_layers_.data();
  if (layout.has_color()) {
    if (next->is_present) last->last_color = models.decode_color(next->in, last->last_color);
    ++next;
  }
  if (layout.has_infrared()) {
    if (next->is_present) last->last_infrared = models.decode_infrared(next->in, last->last_infrared);
    ++next;
  }
  for (std::size_t k = 0; k < layout.extra_bytes; ++k, ++next)
    if (next->is_present) last->last_extra[k] = models.decode_extra(next->in, k, last->last_extra[k]);
  attributes_of_point_ = last;
}

inline void layered_decoder::put_record(const record_layout& layout, char* record) const {
  char* at = channels_[channel_].last().put(record);
  if (layout.has_color()) at = attributes_of_point_->last_color.put(at);
  if (layout.has_infrared()) at = put_little(at, attributes_of_point_->last_infrared);
  std::copy(attributes_of_point_->last_extra.begin(), attributes_of_point_->last_extra.end(), at);
}

template <class Output>
void layered_decoder::decode(const record_layout& layout, std::span<const char> bytes, std::size_t count,
                             const Output& output) {
  if (bytes.size() < layout.header_size()) throw damaged_chunk();
  layer_reader next_layer(layout, bytes);
  layer layers[point_layers];
  const std::size_t wanted = Output::has_records ? point_layers : record_layout::coordinate_layers;
  for (std::size_t i = 0; i < wanted; ++i) layers[i] = next_layer();
  reset(point14::load_from(bytes.data()));
  if constexpr (Output::has_records) {
    attribute_layers_.resize(layout.layers() - point_layers);
    for (layer& l : attribute_layers_) l = next_layer();
    reset_attributes(layout, bytes.data());
  }
  for (std::size_t i = 0;;) {
    if constexpr (Output::has_records) {
      put_record(layout, output.record(i));
    } else {
      const point14& point = channels_[channel_].last();
      output.put(i, point.position, point.mark());
    }
    if (++i == count) break;
    arithmetic_decoder& in = layers[xy_layer].in;
    const std::uint32_t changes = channels_[channel_].decode_changes(in);
    if (changes & 64) change_channel(channels_[channel_].decode_channel(in));
    channels_[channel_].decode_coordinates(layers, changes, channel_);
    if constexpr (Output::has_records) {
      channels_[channel_].decode_attributes(layers, changes);
      // Version 3 codes the attributes of points whose channel does not change in channel 0.
      decode_attributes(layout, layout.version >= 4 || changes & 64 ? channel_ : std::uint8_t(0));
    }
    if (in.is_overrun()) throw damaged_chunk();
  }
  if (count > 1)
    for (const layer& l : layers)
      if (l.is_present && l.in.is_overrun()) throw damaged_chunk();
}

}  // namespace globalmatch::support::laz

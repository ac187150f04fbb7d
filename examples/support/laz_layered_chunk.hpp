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

  void begin_as(const channel_attributes& other) {
    last_color = other.last_color;
    last_infrared = other.last_infrared;
    last_extra = other.last_extra;
  }

  void decode_color(layer& from, color& last) {
    if (from.is_present) last = color_.decode(from.in, last);
  }

  void decode_infrared(layer& from, std::uint16_t& last) {
    if (!from.is_present) return;
    arithmetic_decoder& in = from.in;
    const std::uint32_t changed = in.decode(infrared_changes_);
    unsigned low = last & 0xFFu, high = last >> 8u;
    if (changed & 1) low = (low + in.decode(infrared_.get(0))) & 0xFFu;
    if (changed & 2) high = (high + in.decode(infrared_.get(1))) & 0xFFu;
    last = static_cast<std::uint16_t>(high << 8 | low);
  }

  void decode_extra(layer& from, std::size_t index, std::uint8_t& last) {
    if (from.is_present) last = static_cast<std::uint8_t>(last + from.in.decode(extra_[index]));
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

/// The models of a chunk, of four scanner channels. The items behind POINT14 change channels in a way of
/// their own.
struct layered_models {
  std::array<channel_decoder, 4> channels;
  std::array<bool, 4> is_used;
  std::array<channel_attributes, 4> attributes;
  std::array<bool, 4> has_attributes;
  std::vector<layer> attribute_layers;
};

/// Decodes a chunk of the formats 6 to 8. For coordinates and counts its bytes may end behind the layers that
/// these need.
template <class Output>
class layered_chunk {
 public:
  /// Of `bytes`, behind which decoders can read on. Throws `damaged_chunk`.
  layered_chunk(layered_models& models, const record_layout& layout, std::span<const char> bytes,
                Output output);

  /// Decodes all points. Throws `damaged_chunk`.
  void decode(std::size_t count);

 private:
  void reset_attributes();
  channel_decoder& change_channel(std::uint8_t number, const point14& last);
  void decode_attributes(const point14& point, bool channel_changes);
  void put(std::size_t index, const point14& point);

  layered_models& models_;
  const record_layout& layout_;
  const char* first_;
  Output output_;
  layer layers_[point_layers];
  channel_decoder* channel_;  // of the first point
  std::uint8_t attribute_channel_ = 0;
  const channel_attributes* attributes_ = nullptr;  // of the last point
};

template <class Output>
layered_chunk<Output>::layered_chunk(layered_models& models, const record_layout& layout,
                                     std::span<const char> bytes, Output output)
    : models_(models), layout_(layout), first_(bytes.data()), output_(output) {
  if (bytes.size() < layout.header_size()) throw damaged_chunk();
  layer_reader next_layer(layout, bytes);
  const std::size_t wanted = Output::has_records ? point_layers : record_layout::coordinate_layers;
  for (std::size_t i = 0; i < wanted; ++i) layers_[i] = next_layer();
  if constexpr (Output::has_counts) layers_[z_layer] = layers_[flags_layer] = {};
  const point14 first = point14::load_from(first_);
  models_.is_used.fill(false);
  models_.is_used[first.channel] = true;
  channel_ = &models_.channels[first.channel];
  channel_->reset(first);
  if constexpr (Output::has_records) {
    models_.attribute_layers.resize(layout.layers() - point_layers);
    for (layer& l : models_.attribute_layers) l = next_layer();
    reset_attributes();
  }
}

template <class Output>
void layered_chunk<Output>::reset_attributes() {
  attribute_channel_ = channel_->last().channel;
  models_.has_attributes.fill(false);
  models_.has_attributes[attribute_channel_] = true;
  channel_attributes& attributes = models_.attributes[attribute_channel_];
  const char* at = first_ + point14::size;
  attributes.last_color = layout_.has_color() ? color::load_from(at) : color{};
  at += 6 * layout_.has_color();
  attributes.last_infrared = layout_.has_infrared() ? load<std::uint16_t>(at, std::endian::little) : 0;
  at += 2 * layout_.has_infrared();
  attributes.last_extra.assign(at, at + layout_.extra_bytes);
  attributes.reset(layout_.extra_bytes);
  attributes_ = &attributes;
}

template <class Output>
channel_decoder& layered_chunk<Output>::change_channel(std::uint8_t number, const point14& last) {
  channel_decoder& channel = models_.channels[number];
  if (!models_.is_used[number]) channel.reset(last);
  models_.is_used[number] = true;
  channel.set_number(number);
  return channel;
}

template <class Output>
void layered_chunk<Output>::decode(std::size_t count) {
  if (count > 1 && !layers_[xy_layer].is_present) throw damaged_chunk();
  layer layers[point_layers];
  std::copy_n(layers_, point_layers, layers);
  arithmetic_decoder& xy = layers[xy_layer].in;
  channel_decoder* channel = channel_;
  put(0, channel->last());
  for (std::size_t i = 1; i < count; ++i) {
    const std::uint32_t changes = channel->decode_changes(xy);
    if (changes & 64) channel = &change_channel(channel->decode_channel(xy), channel->last());
    channel->decode_returns(xy, changes);
    channel->decode_position(xy, layers[z_layer]);
    channel->decode_class(layers[class_layer], layers[flags_layer]);
    if constexpr (Output::has_records) {
      channel->decode_attributes(layers, changes);
      decode_attributes(channel->last(), (changes & 64) != 0);
    }
    put(i, channel->last());
    constexpr std::size_t wanted = Output::has_records ? point_layers : record_layout::coordinate_layers;
    for (std::size_t k = 0; k < wanted; ++k)
      if (layers[k].in.is_overrun()) throw damaged_chunk();
  }
}

template <class Output>
void layered_chunk<Output>::decode_attributes(const point14& point, bool channel_changes) {
  // Version 3 codes the attributes of points whose channel does not change in channel 0, and predicts them
  // from the last point of the old channel where it does, unless the new one comes for the first time.
  const std::uint8_t channel = layout_.version >= 4 || channel_changes ? point.channel : std::uint8_t(0);
  channel_attributes& models = models_.attributes[channel];
  channel_attributes* last = &models_.attributes[attribute_channel_];
  if (channel != attribute_channel_) {
    attribute_channel_ = channel;
    if (!models_.has_attributes[channel]) {
      models.begin_as(*last);
      models.reset(layout_.extra_bytes);
      models_.has_attributes[channel] = true;
      last = &models;
    } else if (layout_.version >= 4) {
      last = &models;
    }
  }
  layer* next = models_.attribute_layers.data();
  if (layout_.has_color()) models.decode_color(*next++, last->last_color);
  if (layout_.has_infrared()) models.decode_infrared(*next++, last->last_infrared);
  for (std::size_t k = 0; k < layout_.extra_bytes; ++k) models.decode_extra(*next++, k, last->last_extra[k]);
  for (const layer& l : models_.attribute_layers)
    if (l.in.is_overrun()) throw damaged_chunk();
  attributes_ = last;
}

template <class Output>
LAZ_INLINE void layered_chunk<Output>::put(std::size_t index, const point14& point) {
  if constexpr (Output::has_records) {
    char* at = point.put(output_.record(index));
    if (layout_.has_color()) at = attributes_->last_color.put(at);
    if (layout_.has_infrared()) at = put_little(at, attributes_->last_infrared);
    std::copy(attributes_->last_extra.begin(), attributes_->last_extra.end(), at);
  } else if constexpr (Output::has_counts) {
    output_.counts->add(point.return_number, point.return_count, point.class_number);
  } else {
    output_.put(index, point.position, point.mark());
  }
}

}  // namespace globalmatch::support::laz

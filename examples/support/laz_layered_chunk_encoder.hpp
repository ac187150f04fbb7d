// Internal to the LAZ writer: chunks of the formats 6 to 8.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "support/laz_layer_encoder.hpp"
#include "support/laz_layout.hpp"

namespace globalmatch::support::laz {

/// Encodes one scanner channel of colours and extra bytes, as `channel_attributes` decodes it.
class channel_attributes_encoder {
 public:
  void reset(std::size_t extra_bytes) {
    color_.reset();
    infrared_changes_.reset();
    infrared_.reset();
    extra_.resize(extra_bytes);
    for (auto& model : extra_) model.reset();
  }

  void encode_color(written_layer& to, const char* last, const char* next) {
    color_.encode(to.out, color::load_from(last), color::load_from(next));
  }

  void encode_infrared(written_layer& to, const char* last, const char* next) {
    const std::uint32_t low = last[0] != next[0], high = last[1] != next[1];
    to.out.encode(infrared_changes_, low | high << 1);
    if (low) to.out.encode(infrared_.get(0), static_cast<std::uint8_t>(next[0] - last[0]));
    if (high) to.out.encode(infrared_.get(1), static_cast<std::uint8_t>(next[1] - last[1]));
  }

  void encode_extra(written_layer& to, std::size_t index, char last, char next) {
    to.out.encode(extra_[index], static_cast<std::uint8_t>(next - last));
  }

  std::vector<char> last_record;  ///< what follows POINT14 in the last record

 private:
  color_encoder color_;
  encoder_model<4> infrared_changes_;
  encoder_models<256, 2> infrared_;
  std::vector<encoder_model<256>> extra_;
};

/// Encodes chunks of the formats 6 to 8. What it allocates is kept for the next chunk.
class layered_chunk_encoder {
 public:
  explicit layered_chunk_encoder(const record_layout& layout)
      : layout_(layout), attribute_layers_(layout.layers() - point_layers) {}

  /// Appends the chunk of these records, of which there must be one at least.
  void encode(std::span<const char> records, std::vector<char>& chunk);

 private:
  void begin(const char* first);
  void encode_point(const char* record);
  void encode_attributes(const char* next, std::uint8_t point_channel, bool channel_changes);
  void write_layers(std::span<const char> records, std::vector<char>& chunk);

  record_layout layout_;
  point_layers_out layers_;
  std::array<channel_encoder, 4> channels_;
  std::array<bool, 4> is_used_;
  channel_encoder* channel_ = nullptr;  // of the last point
  std::vector<written_layer> attribute_layers_;
  std::array<channel_attributes_encoder, 4> attributes_;
  std::array<bool, 4> has_attributes_;
  std::uint8_t attribute_channel_ = 0;
};

inline void layered_chunk_encoder::begin(const char* first) {
  for (written_layer& layer : layers_) layer.begin();
  for (written_layer& layer : attribute_layers_) layer.begin();
  layers_[xy_layer].changes = true;  // decoders need it
  const point14 point = point14::load_from(first);
  is_used_.fill(false);
  is_used_[point.channel] = true;
  channel_ = &channels_[point.channel];
  channel_->reset(point);
  has_attributes_.fill(false);
  attribute_channel_ = point.channel;
  has_attributes_[point.channel] = true;
  attributes_[point.channel].last_record.assign(first + point14::size, first + layout_.record_size());
  attributes_[point.channel].reset(layout_.extra_bytes);
}

inline void layered_chunk_encoder::encode(std::span<const char> records, std::vector<char>& chunk) {
  const std::size_t size = layout_.record_size();
  begin(records.data());
  for (std::size_t at = size; at < records.size(); at += size) encode_point(records.data() + at);
  write_layers(records, chunk);
}

inline void layered_chunk_encoder::encode_point(const char* record) {
  const point14 point = point14::load_from(record);
  const bool channel_changes = point.channel != channel_->last().channel;
  channel_encoder& channel = channels_[point.channel];
  if (!is_used_[point.channel]) channel.reset(channel_->last());
  is_used_[point.channel] = true;
  const std::uint32_t changes = channel.changes_to(point) | std::uint32_t(channel_changes) << 6;
  channel_->encode_changes(layers_[xy_layer].out, changes, point.channel);
  channel_ = &channel;
  channel.encode(layers_, point, changes);
  if (!attribute_layers_.empty()) encode_attributes(record + point14::size, point.channel, channel_changes);
}

// Channels change as `layered_chunk::decode_attributes` says of version 3.
inline void layered_chunk_encoder::encode_attributes(const char* next, std::uint8_t point_channel,
                                                     bool channel_changes) {
  const std::uint8_t channel = channel_changes ? point_channel : std::uint8_t(0);
  channel_attributes_encoder& models = attributes_[channel];
  std::vector<char>* last = &attributes_[attribute_channel_].last_record;
  if (channel != attribute_channel_) {
    attribute_channel_ = channel;
    if (!has_attributes_[channel]) {
      models.last_record = *last;
      models.reset(layout_.extra_bytes);
      has_attributes_[channel] = true;
      last = &models.last_record;
    }
  }
  const char* at = last->data();
  written_layer* layer = attribute_layers_.data();
  const auto step = [&](std::size_t size) {
    layer->changes |= !std::equal(at, at + size, next);
    at += size;
    next += size;
    ++layer;
  };
  const char* first = next;
  if (layout_.has_color()) {
    models.encode_color(*layer, at, next);
    step(6);
  }
  if (layout_.has_infrared()) {
    models.encode_infrared(*layer, at, next);
    step(2);
  }
  for (std::size_t k = 0; k < layout_.extra_bytes; ++k) {
    models.encode_extra(*layer, k, *at, *next);
    step(1);
  }
  std::copy(first, next, last->begin());
}

inline void layered_chunk_encoder::write_layers(std::span<const char> records, std::vector<char>& chunk) {
  const std::size_t size = layout_.record_size(), begin = chunk.size();
  chunk.insert(chunk.end(), records.begin(), records.begin() + static_cast<std::ptrdiff_t>(size));
  chunk.resize(begin + layout_.header_size());
  std::size_t at = begin + size;
  const auto put_number = [&](std::size_t number) {
    put_little(chunk.data() + at, static_cast<std::uint32_t>(number));
    at += 4;
  };
  const auto put_layer = [&](written_layer& layer) {
    const std::span<const char> bytes = layer.changes ? layer.out.finish() : std::span<const char>();
    put_number(bytes.size());
    chunk.insert(chunk.end(), bytes.begin(), bytes.end());
  };
  put_number(records.size() / size);
  for (written_layer& layer : layers_) put_layer(layer);
  for (written_layer& layer : attribute_layers_) put_layer(layer);
}

}  // namespace globalmatch::support::laz

#include "support/laz_chunk_decoder.hpp"

#include <algorithm>
#include <utility>

#include "support/laz_items.hpp"
#include "support/laz_layered_chunk.hpp"
#include "support/scalars.hpp"

namespace globalmatch::support::laz {

namespace {

[[noreturn]] void fail_damaged(const file_bytes& file) {
  file.fail("has damaged compressed points", "Copy or export the scan again");
}

}  // namespace

// Not initialised when they are allocated: a megabyte of models, of which most chunks use little.
struct chunk_decoder::models {
  std::unique_ptr<item_decoder> items;
  std::unique_ptr<layered_decoder> layers;
};

chunk_decoder::chunk_decoder(const file_bytes& file, const record_layout& layout)
    : file_(file), layout_(layout), models_(std::make_unique<models>()) {
  if (layout_.is_layered())
    models_->layers = std::make_unique_for_overwrite<layered_decoder>();
  else
    models_->items = std::make_unique_for_overwrite<item_decoder>();
}

chunk_decoder::~chunk_decoder() = default;

void chunk_decoder::decode(const chunk& chunk, std::span<raw_point> points, std::span<point_mark> marks) {
  decode_into(chunk, coordinates_output{points.data(), marks.data()});
}

void chunk_decoder::decode_records(const chunk& chunk, std::span<char> records) {
  decode_into(chunk, records_output{records.data(), layout_.record_size()});
}

template <class Output>
void chunk_decoder::decode_into(const chunk& chunk, const Output& output) {
  const auto count = static_cast<std::size_t>(chunk.count);
  try {
    if (layout_.is_layered()) {
      const std::uint64_t size = Output::has_records ? chunk.size : coordinates_size(chunk);
      models_->layers->decode(layout_, read(chunk.offset, size), count, output);
    } else {
      models_->items->decode(layout_, read(chunk.offset, chunk.size), count, output);
    }
  } catch (const damaged_chunk&) {
    fail_damaged(file_);
  }
}

// The layers that coordinates need are the first of a chunk.
std::uint64_t chunk_decoder::coordinates_size(const chunk& chunk) {
  const std::size_t header_size = layout_.header_size();
  if (chunk.size < header_size) throw damaged_chunk();
  const std::span<const char> header = read(chunk.offset, header_size);
  std::uint64_t size = header_size;
  for (std::size_t i = 0; i < record_layout::coordinate_layers; ++i)
    size += load<std::uint32_t>(header.data() + layout_.record_size() + 4 + 4 * i, std::endian::little);
  return std::min(size, chunk.size);
}

std::uint64_t chunk_decoder::size_of(std::uint64_t offset, std::uint64_t count) {
  // Compressed points are hardly ever longer than others; models are learned in some more bytes.
  const std::uint64_t longest = 2 * count * layout_.record_size() + 65536;
  const std::span<const char> bytes = read(offset, std::min(file_.size() - offset, longest));
  try {
    return models_->items->decode(layout_, bytes, static_cast<std::size_t>(count), no_output());
  } catch (const damaged_chunk&) {
    fail_damaged(file_);
  }
}

std::span<const char> chunk_decoder::read(std::uint64_t offset, std::uint64_t size) {
  const auto count = static_cast<std::size_t>(size);
  if (capacity_ < count + padding) {
    bytes_ = std::make_unique_for_overwrite<char[]>(count + padding);
    capacity_ = count + padding;
  }
  file_.read(offset, {bytes_.get(), count});
  std::fill_n(bytes_.get() + count, padding, '\0');
  return {bytes_.get(), count};
}

void chunk_decoders::decode(const chunk& chunk, std::span<raw_point> points, std::span<point_mark> marks) {
  std::unique_ptr<chunk_decoder> decoder;
  {
    const std::scoped_lock lock(mutex_);
    if (!idle_.empty()) {
      decoder = std::move(idle_.back());
      idle_.pop_back();
    }
  }
  if (!decoder) decoder = std::make_unique<chunk_decoder>(file_, layout_);
  decoder->decode(chunk, points, marks);
  const std::scoped_lock lock(mutex_);
  idle_.push_back(std::move(decoder));
}

}  // namespace globalmatch::support::laz

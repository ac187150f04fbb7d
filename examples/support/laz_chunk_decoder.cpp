#include "support/laz_chunk_decoder.hpp"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "support/laz_items.hpp"
#include "support/laz_layered_chunk.hpp"
#include "support/scalars.hpp"

namespace globalmatch::support::laz {

namespace {

[[noreturn]] void fail_damaged(const file_bytes& file) {
  file.fail("has damaged compressed points", "Copy or export the scan again");
}

/// Bytes of a file, behind which decoders can read on for the symbols of a point.
class padded_bytes {
 public:
  explicit padded_bytes(const record_layout& layout)
      : padding_(arithmetic_decoder::max_bytes * (max_symbols + layout.extra_bytes)) {}

  std::span<const char> read(const file_bytes& file, std::uint64_t offset, std::uint64_t size) {
    const auto count = static_cast<std::size_t>(size);
    if (capacity_ < count + padding_) {
      bytes_ = std::make_unique_for_overwrite<char[]>(count + padding_);
      capacity_ = count + padding_;
    }
    file.read(offset, {bytes_.get(), count});
    std::fill_n(bytes_.get() + count, padding_, '\0');
    return {bytes_.get(), count};
  }

 private:
  static constexpr std::size_t max_symbols = 64;  // of a point without extra bytes

  std::size_t padding_;
  std::unique_ptr<char[]> bytes_;
  std::size_t capacity_ = 0;
};

// Decodes all points of a chunk. Returns how many bytes they take.
template <class Output>
std::size_t decode_items(const record_layout& layout, item_models& models, std::span<const char> bytes,
                         std::size_t count, const Output& output) {
  const auto decode = [&]<bool HasTime, bool HasColor>(std::bool_constant<HasTime>,
                                                       std::bool_constant<HasColor>) {
    return item_chunk<HasTime, HasColor, Output>(models, layout, bytes, output).decode(count);
  };
  constexpr std::true_type yes;
  constexpr std::false_type no;
  if (layout.has_color()) return layout.has_time() ? decode(yes, yes) : decode(no, yes);
  return layout.has_time() ? decode(yes, no) : decode(no, no);
}

}  // namespace

// Models are not initialised when they are allocated: of the megabyte, most chunks use little.
struct chunk_decoder::models {
  explicit models(const record_layout& layout) : bytes(layout) {
    if (layout.is_layered())
      layers = std::make_unique_for_overwrite<layered_models>();
    else
      items = std::make_unique_for_overwrite<item_models>();
  }

  std::unique_ptr<item_models> items;
  std::unique_ptr<layered_models> layers;
  padded_bytes bytes;
};

chunk_decoder::chunk_decoder(const file_bytes& file, const record_layout& layout)
    : file_(file), layout_(layout), models_(std::make_unique<models>(layout)) {}

chunk_decoder::~chunk_decoder() = default;

void chunk_decoder::decode(const chunk& chunk, std::span<raw_point> points, std::span<point_mark> marks) {
  decode_into(chunk, coordinates_output{points.data(), marks.data()});
}

void chunk_decoder::count(const chunk& chunk, class_counts& counts) {
  decode_into(chunk, counts_output{&counts});
}

void chunk_decoder::decode_records(const chunk& chunk, std::span<char> records) {
  decode_into(chunk, records_output{records.data(), layout_.record_size()});
}

template <class Output>
void chunk_decoder::decode_into(const chunk& chunk, const Output& output) try {
  const auto count = static_cast<std::size_t>(chunk.count);
  if (layout_.is_layered()) {
    const std::uint64_t size = Output::has_records ? chunk.size : coordinates_size(chunk);
    const std::span<const char> bytes = models_->bytes.read(file_, chunk.offset, size);
    layered_chunk<Output>(*models_->layers, layout_, bytes, output).decode(count);
  } else {
    const std::span<const char> bytes = models_->bytes.read(file_, chunk.offset, chunk.size);
    decode_items(layout_, *models_->items, bytes, count, output);
  }
} catch (const damaged_chunk&) {
  fail_damaged(file_);
}

// The layers that coordinates need are the first of a chunk.
std::uint64_t chunk_decoder::coordinates_size(const chunk& chunk) {
  std::uint64_t size = layout_.header_size();
  if (chunk.size < size) throw damaged_chunk();
  const std::span<const char> header = models_->bytes.read(file_, chunk.offset, size);
  for (std::size_t i = 0; i < record_layout::coordinate_layers; ++i)
    size += load<std::uint32_t>(header.data() + layout_.record_size() + 4 + 4 * i, std::endian::little);
  return std::min(size, chunk.size);
}

std::uint64_t chunk_decoder::size_of(std::uint64_t offset, std::uint64_t count) try {
  // Compressed points are hardly ever longer than others; models are learned in some more bytes.
  const std::uint64_t longest = 2 * count * layout_.record_size() + 65536;
  const std::uint64_t size = std::min(file_.size() - offset, longest);
  const std::span<const char> bytes = models_->bytes.read(file_, offset, size);
  return decode_items(layout_, *models_->items, bytes, static_cast<std::size_t>(count), no_output());
} catch (const damaged_chunk&) {
  fail_damaged(file_);
}

template <class Work>
void chunk_decoders::with_decoder(const Work& work) {
  std::unique_ptr<chunk_decoder> decoder;
  {
    const std::scoped_lock lock(mutex_);
    if (!idle_.empty()) {
      decoder = std::move(idle_.back());
      idle_.pop_back();
    }
  }
  if (!decoder) decoder = std::make_unique<chunk_decoder>(file_, layout_);
  work(*decoder);
  const std::scoped_lock lock(mutex_);
  idle_.push_back(std::move(decoder));
}

void chunk_decoders::decode(const chunk& chunk, std::span<raw_point> points, std::span<point_mark> marks) {
  with_decoder([&](chunk_decoder& decoder) { decoder.decode(chunk, points, marks); });
}

void chunk_decoders::count(const chunk& chunk, class_counts& counts) {
  with_decoder([&](chunk_decoder& decoder) { decoder.count(chunk, counts); });
}

void chunk_decoders::decode_records(const chunk& chunk, std::span<char> records) {
  with_decoder([&](chunk_decoder& decoder) { decoder.decode_records(chunk, records); });
}

}  // namespace globalmatch::support::laz

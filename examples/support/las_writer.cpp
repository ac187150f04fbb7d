#include "support/las_writer.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <limits>
#include <string_view>

#include "support/las_fields.hpp"
#include "support/las_header.hpp"
#include "support/laz_layout.hpp"
#include "support/laz_points.hpp"
#include "support/scalars.hpp"

namespace globalmatch::support {

namespace {

using laz::put_little;

constexpr unsigned compressed_bit = 0x80;  // of the format

// A record between the header and the points.
std::string variable_record(std::string_view user, std::uint16_t number, std::string_view content) {
  constexpr std::size_t start_size = 54;
  std::string record(start_size, '\0');
  user.copy(record.data() + 2, 16);
  put_little(record.data() + 18, number);
  put_little(record.data() + 20, static_cast<std::uint16_t>(content.size()));
  return record.append(content);
}

laz::record_layout layout_of(const las_layout& layout) {
  // Layers are coded by version 3, which all programs read that read layers.
  return {layout.format, layout.records.record_size - las_format_size(layout.format), 3};
}

std::string laszip_content(const laz::record_layout& layout) {
  constexpr std::size_t fixed_size = 34, item_size = 6;
  const auto items = laz::laszip_items(layout);
  std::string content(fixed_size + item_size * items.size(), '\0');
  char* bytes = content.data();
  put_little(bytes, std::uint16_t(layout.is_layered() ? 3 : 2));     // in chunks, or in chunks of layers
  put_little(bytes + 4, std::uint8_t(layout.is_layered() ? 3 : 2));  // version of LASzip that can do it
  put_little(bytes + 5, std::uint8_t(layout.is_layered() ? 4 : 2));
  put_little(bytes + 6, std::uint16_t(layout.is_layered() ? 3 : 0));
  put_little(bytes + 12, laz::chunk_writer::chunk_size);
  put_little(bytes + 16, std::int64_t(-1));  // no special records
  put_little(bytes + 24, std::int64_t(-1));
  put_little(bytes + 32, static_cast<std::uint16_t>(items.size()));
  bytes += fixed_size;
  for (const auto& [type, size, version] : items)
    for (const std::uint16_t number : {type, size, version}) bytes = put_little(bytes, number);
  return content;
}

}  // namespace

las_writer::las_writer(std::ostream& out, const las_layout& layout, bool is_compressed, int threads)
    : out_(out), layout_(layout), is_compressed_(is_compressed), variable_records_(variable_records()) {
  min_.fill(std::numeric_limits<std::int32_t>::max());
  max_.fill(std::numeric_limits<std::int32_t>::min());
  out_ << header() << variable_records_;
  if (is_compressed_) chunks_ = std::make_unique<laz::chunk_writer>(out_, layout_of(layout_), threads);
}

std::string las_writer::variable_records() const {
  std::string records = variable_record("LASF_Spec", 4, describe_extra_fields(layout_.extra_fields));
  for (const auto& [number, content] : layout_.projection)
    records += variable_record("LASF_Projection", number, content);
  if (is_compressed_) records += variable_record("laszip encoded", 22204, laszip_content(layout_of(layout_)));
  return records;
}

std::string las_writer::header() const {
  const bool is_1_4 = layout_.minor_version >= 4;
  std::string header(is_1_4 ? las_header_size_1_4 : las_header_size_1_2, '\0');
  char* bytes = header.data();
  std::string_view("LASF").copy(bytes, 4);
  put_little(bytes + 6, layout_.encoding);
  bytes[24] = 1;
  bytes[25] = static_cast<char>(layout_.minor_version);
  std::string_view("MERGE").copy(bytes + 26, 32);
  std::string_view("globalmatch").copy(bytes + 58, 32);
  put_little(bytes + 94, static_cast<std::uint16_t>(header.size()));
  put_little(bytes + 96, static_cast<std::uint32_t>(header.size() + variable_records_.size()));
  put_little(bytes + 100, static_cast<std::uint32_t>(1 + layout_.projection.size() + is_compressed_));
  bytes[104] = static_cast<char>(layout_.format | (is_compressed_ ? compressed_bit : 0));
  put_little(bytes + 105, static_cast<std::uint16_t>(layout_.records.record_size));
  // The counts of 32 bits are zero where formats came later than those of 64 bits.
  if (!is_1_4) put_little(bytes + 107, static_cast<std::uint32_t>(count_));
  for (std::size_t i = 0; i < 5 && !is_1_4; ++i)
    put_little(bytes + 111 + 4 * i, static_cast<std::uint32_t>(counts_by_return_[i + 1]));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double scale = layout_.records.grid->scale[Eigen::Index(axis)];
    const double offset = layout_.records.grid->offset[Eigen::Index(axis)];
    put_little(bytes + 131 + 8 * axis, scale);
    put_little(bytes + 155 + 8 * axis, offset);
    put_little(bytes + 179 + 16 * axis, count_ > 0 ? max_[axis] * scale + offset : 0.0);
    put_little(bytes + 187 + 16 * axis, count_ > 0 ? min_[axis] * scale + offset : 0.0);
  }
  if (is_1_4) put_little(bytes + 247, count_);
  for (std::size_t i = 0; i < 15 && is_1_4; ++i) put_little(bytes + 255 + 8 * i, counts_by_return_[i + 1]);
  return header;
}

void las_writer::write(std::span<const char> records) {
  count(records);
  if (chunks_)
    chunks_->write(records);
  else
    out_.write(records.data(), static_cast<std::streamsize>(records.size()));
}

void las_writer::count(std::span<const char> records) {
  const unsigned return_mask = layout_.format >= 6 ? 15 : 7;
  const std::size_t size = layout_.records.record_size;
  count_ += records.size() / size;
  for (std::size_t at = 0; at < records.size(); at += size) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto c = load<std::int32_t>(records.data() + at + 4 * axis, std::endian::little);
      min_[axis] = std::min(min_[axis], c);
      max_[axis] = std::max(max_[axis], c);
    }
    ++counts_by_return_[static_cast<unsigned char>(records[at + 14]) & return_mask];
  }
}

void las_writer::finish() {
  if (chunks_) chunks_->finish();
  out_.seekp(0);
  out_ << header();
}

}  // namespace globalmatch::support

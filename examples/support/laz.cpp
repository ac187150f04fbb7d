#include "support/laz.hpp"

#include <algorithm>
#include <optional>
#include <type_traits>
#include <utility>

#include "globalmatch/detail/core/threads.hpp"
#include "support/class_counts.hpp"
#include "support/large_array.hpp"
#include "support/las_points.hpp"
#include "support/laz_chunk_cache.hpp"
#include "support/laz_chunk_decoder.hpp"
#include "support/laz_chunk_table.hpp"

namespace globalmatch::support {

namespace {

[[noreturn]] void refuse(const file_bytes& file, const std::string& what) {
  std::filesystem::path converted = file.path();
  converted.replace_extension(".las");
  if (converted == file.path()) converted.replace_extension(".uncompressed.las");
  const std::string in = '"' + file.path().string() + '"';
  const std::string out = '"' + converted.string() + '"';
  file.fail("is compressed (LAZ) " + what + ", which this program does not read",
            "Convert it: las2las -i " + in + " -o " + out + "   or: pdal translate " + in + " " + out);
}

laz::record_layout layout_of(const file_bytes& file, const las_header& header, const laszip_record& laszip) {
  constexpr unsigned pointwise = 1, chunked = 2, layered = 3;
  const unsigned format = header.format;
  const std::size_t size = las_format_size(format);
  if (format == 4 || format == 5 || format == 9 || format == 10) refuse(file, "with wave packets");
  if (laszip.compressor == pointwise) refuse(file, "point by point, as before LASzip 2.0");
  if (size == 0 || laszip.compressor != (format >= 6 ? layered : chunked)) refuse(file, "in an unknown way");
  if (header.record_size < size || laszip.chunk_size == 0)
    file.fail("has a damaged LAS header", "Copy or export the scan again");
  const laz::record_layout layout{format, header.record_size - size, laszip.items.front().version};
  if (laszip.items != laz::laszip_items(layout) ||
      (layout.is_layered() && layout.version != 3 && layout.version != 4))
    refuse(file, "with items of an unknown version");
  return layout;
}

/// What is kept of a chunk.
struct chunk_points {
  std::vector<raw_point> points;
  std::vector<point_mark> marks;
};
using chunk_records = std::vector<char>;

/// A file, its chunks, and their attributes, which are decoded when they are asked for.
class laz_points : public point_source {
 public:
  laz_points(file_bytes file, const las_header& header, const laz::record_layout& layout,
             std::vector<laz::chunk> chunks, std::vector<record_field> fields, const scan_options& options)
      : file_(std::move(file)),
        chunks_(std::move(chunks)),
        decoders_(file_, layout),
        scaling_(header.scale, header.offset, options.keep_marked, size_of_all(chunks_)),
        fields_(std::move(fields)),
        record_size_(header.record_size),
        records_(chunks_, options.threads, [this](const laz::chunk& chunk, chunk_records& records) {
          records.resize(static_cast<std::size_t>(chunk.count) * record_size_);
          decoders_.decode_records(chunk, records);
        }) {}

  static std::size_t size_of_all(const std::vector<laz::chunk>& chunks) {
    return chunks.empty() ? 0 : static_cast<std::size_t>(chunks.back().first + chunks.back().count);
  }

  std::size_t size() const override { return scaling_.size(); }
  marked_points marked() const override { return scaling_.marked(); }
  std::vector<attribute> attributes() const override { return attributes_of(fields_); }

  void read_attributes(std::size_t first, std::size_t count,
                       std::span<attribute_column> columns) const override {
    std::vector<char> bytes(count * record_size_);
    records_.for_each_piece(
        first, count,
        [&](const chunk_records& records, std::size_t begin, std::size_t size, std::size_t done) {
          std::copy_n(records.data() + begin * record_size_, size * record_size_,
                      bytes.data() + done * record_size_);
        });
    gather({bytes.data(), record_size_, count}, fields_, columns);
  }

  std::optional<class_counts> count_classes(const execution& exec) const override {
    return count_in_chunks(exec, chunks_.size(), 1,
                           [&](std::size_t begin, std::size_t end, class_counts& counts) {
                             for (std::size_t i = begin; i < end; ++i) decoders_.count(chunks_[i], counts);
                           });
  }

 protected:
  file_bytes file_;
  std::vector<laz::chunk> chunks_;
  mutable laz::chunk_decoders decoders_;
  mutable point_scaling scaling_;

 private:
  std::vector<record_field> fields_;
  std::size_t record_size_;
  mutable laz::chunk_cache<chunk_records> records_;
};

/// Points of which coordinates and marks were decoded at once.
class decoded_laz final : public laz_points {
 public:
  decoded_laz(file_bytes file, const las_header& header, const laz::record_layout& layout,
              std::vector<laz::chunk> chunks, std::vector<record_field> fields, const scan_options& options)
      : laz_points(std::move(file), header, layout, std::move(chunks), std::move(fields), options),
        points_(size()),
        marks_(size()) {
    const execution exec{.threads = options.threads};
    detail::parallel_for(
        exec, "decode points", chunks_.size(),
        [&](std::size_t i) {
          const auto first = static_cast<std::size_t>(chunks_[i].first);
          const auto count = static_cast<std::size_t>(chunks_[i].count);
          decoders_.decode(chunks_[i], {points_.data() + first, count}, {marks_.data() + first, count});
        },
        1);
  }

  void read(std::size_t first, std::span<Eigen::Vector3d> points) const override {
    scaling_.scale(first, {points_.data() + first, points.size()}, {marks_.data() + first, points.size()},
                   points);
  }

 private:
  large_array<raw_point> points_;
  large_array<point_mark> marks_;
};

/// Points that are decoded when they are asked for.
class streamed_laz final : public laz_points {
 public:
  streamed_laz(file_bytes file, const las_header& header, const laz::record_layout& layout,
               std::vector<laz::chunk> chunks, std::vector<record_field> fields, const scan_options& options)
      : laz_points(std::move(file), header, layout, std::move(chunks), std::move(fields), options),
        decoded_(chunks_, options.threads, [this](const laz::chunk& chunk, chunk_points& content) {
          const auto count = static_cast<std::size_t>(chunk.count);
          content.points.resize(count);
          content.marks.resize(count);
          decoders_.decode(chunk, content.points, content.marks);
        }) {}

  void read(std::size_t first, std::span<Eigen::Vector3d> points) const override {
    raw_point raw[block_size];
    point_mark marks[block_size];
    for (std::size_t done = 0; done < points.size();) {
      const std::size_t begin = first + done;
      const std::size_t count = std::min(points.size() - done, block_size - begin % block_size);
      decoded_.for_each_piece(
          begin, count, [&](const chunk_points& from, std::size_t at, std::size_t size, std::size_t behind) {
            std::copy_n(from.points.data() + at, size, raw + behind);
            std::copy_n(from.marks.data() + at, size, marks + behind);
          });
      scaling_.scale(begin, {raw, count}, {marks, count}, points.subspan(done, count));
      done += count;
    }
  }

 private:
  mutable laz::chunk_cache<chunk_points> decoded_;
};

}  // namespace

std::unique_ptr<point_source> open_laz(file_bytes file, const las_header& header, const laszip_record& laszip,
                                       std::vector<record_field> fields, const scan_options& options,
                                       std::vector<std::string>& notes) {
  const laz::record_layout layout = layout_of(file, header, laszip);
  laz::located_chunks located = laz::locate_chunks(file, header, laszip, layout);
  if (located.has_more) notes.push_back(note_on_more_points(header.count, "further points"));
  const std::uint64_t size = laz_points::size_of_all(located.chunks);
  const auto open = [&]<class Points>(std::type_identity<Points>) -> std::unique_ptr<point_source> {
    return std::make_unique<Points>(std::move(file), header, layout, std::move(located.chunks),
                                    std::move(fields), options);
  };
  return size <= options.memory / (sizeof(raw_point) + sizeof(point_mark))
             ? open(std::type_identity<decoded_laz>())
             : open(std::type_identity<streamed_laz>());
}

}  // namespace globalmatch::support

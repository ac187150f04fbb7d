#include "support/laz.hpp"

#include <algorithm>
#include <utility>

#include "globalmatch/detail/core/threads.hpp"
#include "support/class_counts.hpp"
#include "support/large_array.hpp"
#include "support/las_points.hpp"
#include "support/laz_chunk_decoder.hpp"
#include "support/laz_chunk_table.hpp"
#include "support/laz_decoded_chunks.hpp"

namespace globalmatch::support {

namespace {

using laz::record_layout;

[[noreturn]] void refuse(const file_bytes& file, const std::string& what) {
  std::filesystem::path converted = file.path();
  converted.replace_extension(".las");
  if (converted == file.path()) converted.replace_extension(".uncompressed.las");
  const std::string in = '"' + file.path().string() + '"';
  const std::string out = '"' + converted.string() + '"';
  file.fail("is compressed (LAZ) " + what + ", which this program does not read",
            "Convert it: las2las -i " + in + " -o " + out + "   or: pdal translate " + in + " " + out);
}

// The items of a record as current compressors code them.
std::vector<laszip_record::item> usual_items(const record_layout& layout) {
  const auto version = static_cast<std::uint16_t>(layout.is_layered() ? layout.version : 2);
  std::vector<laszip_record::item> items;
  if (layout.is_layered()) {
    items.push_back({10, 30, version});
    if (layout.has_infrared()) items.push_back({12, 8, version});
    if (layout.has_color() && !layout.has_infrared()) items.push_back({11, 6, version});
  } else {
    items.push_back({6, 20, version});
    if (layout.has_time()) items.push_back({7, 8, version});
    if (layout.has_color()) items.push_back({8, 6, version});
  }
  const std::uint16_t bytes = layout.is_layered() ? 14 : 0;
  if (layout.extra_bytes > 0)
    items.push_back({bytes, static_cast<std::uint16_t>(layout.extra_bytes), version});
  return items;
}

record_layout layout_of(const file_bytes& file, const las_header& header, const laszip_record& laszip) {
  constexpr unsigned pointwise = 1, chunked = 2, layered = 3;
  const unsigned format = header.format;
  const std::size_t size = las_format_size(format);
  if (format == 4 || format == 5 || format == 9 || format == 10) refuse(file, "with wave packets");
  if (laszip.compressor == pointwise) refuse(file, "point by point, as before LASzip 2.0");
  if (size == 0 || laszip.compressor != (format >= 6 ? layered : chunked)) refuse(file, "in an unknown way");
  if (header.record_size < size || laszip.chunk_size == 0)
    file.fail("has a damaged LAS header", "Copy or export the scan again");
  const record_layout layout{format, header.record_size - size, laszip.items.front().version};
  if (laszip.items != usual_items(layout) ||
      (layout.is_layered() && layout.version != 3 && layout.version != 4))
    refuse(file, "with items of an unknown version");
  return layout;
}

/// What points have in common that are decoded at once and those that are decoded when they are asked for.
class laz_points : public point_source {
 public:
  std::size_t size() const final { return scaling_.size(); }
  marked_points marked() const final { return scaling_.marked(); }

  std::optional<class_counts> count_classes(const execution& exec) const final {
    laz::chunk_decoders decoders(file_, layout_);
    return count_in_chunks(exec, chunks_.size(), 1,
                           [&](std::size_t begin, std::size_t end, class_counts& counts) {
                             for (std::size_t i = begin; i < end; ++i) decoders.count(chunks_[i], counts);
                           });
  }

 protected:
  laz_points(file_bytes file, const las_header& header, const record_layout& layout,
             std::vector<laz::chunk> chunks, bool keep_marked, std::size_t size)
      : file_(std::move(file)),
        layout_(layout),
        chunks_(std::move(chunks)),
        scaling_(header.scale, header.offset, keep_marked, size) {}

  file_bytes file_;
  record_layout layout_;
  std::vector<laz::chunk> chunks_;
  mutable point_scaling scaling_;
};

/// Points of which coordinates and marks were decoded at once.
class decoded_laz final : public laz_points {
 public:
  decoded_laz(file_bytes file, const las_header& header, const record_layout& layout,
              std::vector<laz::chunk> chunks, const scan_options& options, std::size_t size)
      : laz_points(std::move(file), header, layout, std::move(chunks), options.keep_marked, size),
        points_(size),
        marks_(size) {
    laz::chunk_decoders decoders(file_, layout_);
    const execution exec{.threads = options.threads};
    detail::parallel_for(
        exec, "decode points", chunks_.size(),
        [&](std::size_t i) {
          const auto first = static_cast<std::size_t>(chunks_[i].first);
          const auto count = static_cast<std::size_t>(chunks_[i].count);
          decoders.decode(chunks_[i], {points_.data() + first, count}, {marks_.data() + first, count});
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
  streamed_laz(const file_bytes& file, const las_header& header, const record_layout& layout,
               const std::vector<laz::chunk>& chunks, const scan_options& options, std::size_t size)
      : laz_points(file, header, layout, chunks, options.keep_marked, size),
        decoded_(file, layout, chunks, options.threads) {}

  void read(std::size_t first, std::span<Eigen::Vector3d> points) const override {
    raw_point raw[block_size];
    point_mark marks[block_size];
    for (std::size_t done = 0; done < points.size();) {
      const std::size_t begin = first + done;
      const std::size_t count = std::min(points.size() - done, block_size - begin % block_size);
      decoded_.read(begin, {raw, count}, {marks, count});
      scaling_.scale(begin, {raw, count}, {marks, count}, points.subspan(done, count));
      done += count;
    }
  }

 private:
  mutable laz::decoded_chunks decoded_;
};

}  // namespace

std::unique_ptr<point_source> open_laz(file_bytes file, const las_header& header, const laszip_record& laszip,
                                       const scan_options& options) {
  const record_layout layout = layout_of(file, header, laszip);
  std::vector<laz::chunk> chunks = laz::locate_chunks(file, header, laszip, layout);
  const std::uint64_t size = chunks.empty() ? 0 : chunks.back().first + chunks.back().count;
  const auto count = static_cast<std::size_t>(size);
  if (size <= options.memory / (sizeof(raw_point) + sizeof(point_mark)))
    return std::make_unique<decoded_laz>(std::move(file), header, layout, std::move(chunks), options, count);
  return std::make_unique<streamed_laz>(file, header, layout, chunks, options, count);
}

}  // namespace globalmatch::support

// The LAS format of the ASPRS, versions 1.0 to 1.4: little endian; every point record starts with x, y and z.
#include "support/las.hpp"

#include <algorithm>
#include <bit>
#include <memory>
#include <utility>

#include "support/class_counts.hpp"
#include "support/file_bytes.hpp"
#include "support/las_header.hpp"
#include "support/las_points.hpp"
#include "support/laz.hpp"
#include "support/record_fields.hpp"
#include "support/scalars.hpp"

namespace globalmatch::support {

namespace {

// How many points there is room for.
std::uint64_t room_for_points(const file_bytes& file, const las_header& header) {
  const bool more_follows = header.extended_at > header.points_at && header.extended_at <= file.size();
  const std::uint64_t bytes = (more_follows ? header.extended_at : file.size()) - header.points_at;
  return bytes / header.record_size;
}

// The number of points: that of the header, or where it announces none, as writers that were interrupted
// leave it, as many as there is room for.
std::uint64_t count_points(const file_bytes& file, const las_header& header) {
  const std::uint64_t room = room_for_points(file, header);
  if (header.count > room) file.fail_truncated();
  return header.count > 0 ? header.count : room;
}

void note_count(const file_bytes& file, const las_header& header, std::vector<std::string>& notes) {
  constexpr unsigned has_wave_packets_behind = 2;  // bit of the encoding
  const std::uint64_t room = room_for_points(file, header);
  if (header.count == 0 && room > 0)
    notes.push_back("the header announces no points: those that the file has room for were read, " +
                    std::to_string(room));
  else if (header.count < room && (header.encoding & has_wave_packets_behind) == 0)
    notes.push_back(
        note_on_more_points(header.count, "bytes of " + std::to_string(room - header.count) + " more"));
}

// Whether three points are outside of the box in the header, by more than its size: many writers round it,
// and some leave it empty.
bool contradicts_box(const point_source& points, const las_header& header) {
  const Eigen::Vector3d size = header.max - header.min;
  if (points.size() == 0 || !size.allFinite() || !(size.array() > 0).all()) return false;
  for (const std::size_t i : {std::size_t(0), points.size() / 2, points.size() - 1}) {
    Eigen::Vector3d p;
    points.read(i, {&p, 1});
    const bool is_outside =
        ((p - header.max).array() > size.array()).any() || ((header.min - p).array() > size.array()).any();
    if (!is_outside) return false;
  }
  return true;
}

/// Points that are not compressed.
class las_points final : public point_source {
 public:
  las_points(file_bytes file, const las_header& header, std::vector<record_field> fields, bool keep_marked)
      : file_(std::move(file)),
        header_(header),
        fields_(std::move(fields)),
        scaling_(header.scale, header.offset, keep_marked,
                 static_cast<std::size_t>(count_points(file_, header))) {}

  std::size_t size() const override { return scaling_.size(); }

  void read(std::size_t first, std::span<Eigen::Vector3d> points) const override {
    const std::size_t most = std::min(points.size(), block_size);
    const auto bytes = std::make_unique_for_overwrite<char[]>(most * header_.record_size);
    for (std::size_t done = 0; done < points.size();) {
      const std::size_t begin = first + done;
      const std::size_t count = std::min(points.size() - done, block_size - begin % block_size);
      read_block(begin, points.subspan(done, count), bytes.get());
      done += count;
    }
  }

  std::vector<attribute> attributes() const override { return attributes_of(fields_); }

  void read_attributes(std::size_t first, std::size_t count,
                       std::span<attribute_column> columns) const override {
    const std::size_t bytes = count * header_.record_size;
    const auto records = std::make_unique_for_overwrite<char[]>(bytes);
    file_.read(header_.points_at + std::uint64_t(first) * header_.record_size, {records.get(), bytes});
    gather({records.get(), header_.record_size, count}, fields_, columns);
  }

  marked_points marked() const override { return scaling_.marked(); }

  std::optional<class_counts> count_classes(const execution& exec) const override {
    return count_in_chunks(
        exec, size(), block_size,
        [&](std::size_t begin, std::size_t end, class_counts& counts) { count(begin, end, counts); });
  }

 private:
  void read_block(std::size_t first, std::span<Eigen::Vector3d> points, char* bytes) const {
    file_.read(header_.points_at + std::uint64_t(first) * header_.record_size,
               {bytes, points.size() * header_.record_size});
    raw_point raw[block_size];
    point_mark marks[block_size];
    for (std::size_t i = 0; i < points.size(); ++i) {
      const char* record = bytes + i * header_.record_size;
      const auto coordinate = [&](std::size_t axis) {
        return load<std::int32_t>(record + 4 * axis, std::endian::little);
      };
      raw[i] = {coordinate(0), coordinate(1), coordinate(2)};
      marks[i] = mark_of_record(record);
    }
    scaling_.scale(first, {raw, points.size()}, {marks, points.size()}, points);
  }

  void count(std::size_t begin, std::size_t end, class_counts& counts) const {
    const std::size_t bytes = (end - begin) * header_.record_size;
    const auto records = std::make_unique_for_overwrite<char[]>(bytes);
    file_.read(header_.points_at + std::uint64_t(begin) * header_.record_size, {records.get(), bytes});
    for (std::size_t at = 0; at < bytes; at += header_.record_size) {
      const auto byte = [&](std::size_t offset) {
        return static_cast<unsigned>(static_cast<unsigned char>(records[at + offset]));
      };
      if (header_.is_long())
        counts.add(byte(14) & 15u, byte(14) >> 4, byte(16));
      else
        counts.add(byte(14) & 7u, byte(14) >> 3 & 7u, byte(15) & 31u);
    }
  }

  point_mark mark_of_record(const char* record) const {
    const auto byte = [&](std::size_t offset) {
      return load<std::uint8_t>(record + offset, std::endian::little);
    };
    // Formats 6 and later have a byte for the class, and the flags before it.
    return header_.is_long() ? mark_of(byte(16), (byte(15) & 4u) != 0) : mark_of_class_byte(byte(15));
  }

  file_bytes file_;
  las_header header_;
  std::vector<record_field> fields_;
  mutable point_scaling scaling_;
};

}  // namespace

opened_scan open_las(input_file& file, const scan_options& options) {
  file_bytes bytes = file.bytes();
  const las_header header = read_las_header(bytes);
  const las_records records = read_las_records(bytes, header);
  opened_scan scan;
  scan.header.format = las_format_name(header, records);
  scan.header.attributes = las_attributes(header, records);
  scan.header.las =
      las_frame{header.scale, header.offset, header.format, header.encoding, records.projection};
  std::vector<record_field> fields = las_record_fields(header, records);
  if (records.laszip) {
    scan.points =
        open_laz(std::move(bytes), header, *records.laszip, std::move(fields), options, scan.header.notes);
    return scan;
  }
  note_count(bytes, header, scan.header.notes);
  scan.points =
      std::make_unique<las_points>(std::move(bytes), header, std::move(fields), options.keep_marked);
  if (contradicts_box(*scan.points, header))
    scan.header.notes.push_back(
        "coordinates are outside of the box that the header gives: is it damaged? Export the scan again");
  return scan;
}

}  // namespace globalmatch::support

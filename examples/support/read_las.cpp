// The LAS format of the ASPRS, versions 1.0 to 1.4: little endian; every point record starts with x, y and z.
#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "support/scalars.hpp"
#include "support/scan_formats.hpp"

namespace globalmatch::support {

namespace {

struct las_header {
  unsigned format;                 ///< of the point records; the upper two bits mark compression
  std::uint16_t size;              ///< [bytes] of the header
  std::uint32_t variable_records;  ///< between the header and the points
  std::uint64_t points_at;         ///< [bytes] from the start of the file
  std::uint64_t record_size;
  std::uint64_t count;
  std::uint64_t extended_at = 0;  ///< [bytes] records after the points; 0: there are none
  Eigen::Vector3d scale, offset;
};

constexpr std::size_t first_header_size = 227;  // version 1.0; later ones append
constexpr std::size_t header_size_1_4 = 375;

template <class T>
T at(std::string_view header, std::size_t offset) {
  return load<T>(header.data() + offset, std::endian::little);
}

Eigen::Vector3d vector_at(std::string_view header, std::size_t offset) {
  return {at<double>(header, offset), at<double>(header, offset + 8), at<double>(header, offset + 16)};
}

las_header parse_header(input_file& file) {
  const std::string_view bytes = file.peek(header_size_1_4);
  if (bytes.size() < first_header_size) file.fail_truncated();
  las_header header;
  header.size = at<std::uint16_t>(bytes, 94);
  header.points_at = at<std::uint32_t>(bytes, 96);
  header.variable_records = at<std::uint32_t>(bytes, 100);
  header.format = at<std::uint8_t>(bytes, 104);
  header.record_size = at<std::uint16_t>(bytes, 105);
  header.count = at<std::uint32_t>(bytes, 107);
  header.scale = vector_at(bytes, 131);
  header.offset = vector_at(bytes, 155);
  // Version 1.4 counts in 64 bits; files of 1.0 to 1.3 have points or other records there.
  if (header.size >= header_size_1_4 && bytes.size() >= header_size_1_4) {
    header.count = std::max(header.count, at<std::uint64_t>(bytes, 247));
    if (at<std::uint32_t>(bytes, 243) > 0) header.extended_at = at<std::uint64_t>(bytes, 235);
  }
  return header;
}

// Compressors set the upper bits of the point format, and leave a record of their own between the header and
// the points, whatever number of records the header announces.
bool is_compressed(std::string_view records, const las_header& header) {
  if (header.format & 0xC0) return true;
  constexpr std::size_t record_header = 54;
  for (std::uint32_t i = 0; i < header.variable_records && records.size() >= record_header; ++i) {
    if (records.substr(2).starts_with("laszip encoded")) return true;
    const std::size_t length = record_header + at<std::uint16_t>(records, 20);
    if (length > records.size()) break;
    records.remove_prefix(length);
  }
  return false;
}

// The number of points: that of the header, or where it announces none, as writers that were interrupted
// leave it, as many as there is room for, if that is a whole number of them.
std::uint64_t count_points(const input_file& file, const las_header& header) {
  const std::uint64_t end = header.points_at + file.remaining();
  const bool more_follows = header.extended_at > header.points_at && header.extended_at <= end;
  const std::uint64_t bytes = more_follows ? header.extended_at - header.points_at : file.remaining();
  if (header.count > bytes / header.record_size) file.fail_truncated();
  if (header.count > 0) return header.count;
  return bytes % header.record_size == 0 ? bytes / header.record_size : 0;
}

[[noreturn]] void refuse_laz(const input_file& file) {
  std::filesystem::path converted = file.path();
  converted.replace_extension(".las");
  if (converted == file.path()) converted.replace_extension(".uncompressed.las");
  const std::string in = '"' + file.path().string() + '"';
  const std::string out = '"' + converted.string() + '"';
  file.fail("is compressed (LAZ), which this program does not read",
            "Convert it: las2las -i " + in + " -o " + out + "   or: pdal translate " + in + " " + out);
}

void require_sane(const input_file& file, const las_header& header) {
  constexpr std::size_t shortest_record = 20;
  const bool scaled =
      header.scale.allFinite() && header.offset.allFinite() && (header.scale.array() != 0).all();
  if (header.size < first_header_size || header.points_at < header.size || !scaled ||
      header.record_size < shortest_record)
    file.fail("has a damaged LAS header", "Copy or export the scan again");
}

/// Whether a record is of the classes 7 (low point) or 18 (high noise), and whether it is withheld. Formats 6
/// and later have a byte for the class, and the flags before it.
struct point_marks {
  bool noise, withheld;
};

point_marks marks_of(const char* record, unsigned format) {
  const auto byte = [&](std::size_t offset) {
    return load<std::uint8_t>(record + offset, std::endian::little);
  };
  const bool is_long = format >= 6;
  const unsigned number = is_long ? byte(16) : byte(15) & 0x1Fu;
  return {number == 7 || number == 18, (byte(15) & (is_long ? 0x04u : 0x80u)) != 0};
}

}  // namespace

std::vector<Eigen::Vector3d> read_las(input_file& file, marked_points& marked) {
  const las_header header = parse_header(file);
  require_sane(file, header);
  file.skip(header.size);
  if (header.points_at - header.size > file.remaining()) file.fail_truncated();
  const std::size_t between = header.points_at - header.size;
  if (is_compressed({file.read(between), between}, header)) refuse_laz(file);
  const std::uint64_t count = count_points(file, header);
  std::vector<Eigen::Vector3d> points;
  points.reserve(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    const char* record = file.read(header.record_size);
    const point_marks marks = marks_of(record, header.format);
    marked.noise += marks.noise;
    marked.withheld += marks.withheld && !marks.noise;
    if (!marked.keep && (marks.noise || marks.withheld)) continue;
    Eigen::Vector3d& p = points.emplace_back();
    for (int axis = 0; axis < 3; ++axis)
      p[axis] = load<std::int32_t>(record + 4 * axis, std::endian::little) * header.scale[axis] +
                header.offset[axis];
  }
  return points;
}

}  // namespace globalmatch::support

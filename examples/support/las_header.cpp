#include "support/las_header.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "support/las_fields.hpp"
#include "support/scalars.hpp"

namespace globalmatch::support {

namespace {

constexpr std::size_t record_header_size = 54;

Eigen::Vector3d vector_at(std::string_view bytes, std::size_t offset) {
  return {number_at<double>(bytes, offset), number_at<double>(bytes, offset + 8),
          number_at<double>(bytes, offset + 16)};
}

std::string_view text_at(std::string_view bytes, std::size_t offset, std::size_t size) {
  const std::string_view text = bytes.substr(offset, size);
  return text.substr(0, text.find('\0'));
}

std::string read_text(const file_bytes& file, std::uint64_t offset, std::size_t size) {
  std::string bytes(size, '\0');
  file.read(offset, bytes);
  return bytes;
}

las_header parse_las_header(std::string_view bytes) {
  las_header header;
  header.encoding = number_at<std::uint16_t>(bytes, 6);
  header.minor_version = number_at<std::uint8_t>(bytes, 25);
  header.size = number_at<std::uint16_t>(bytes, 94);
  header.points_at = number_at<std::uint32_t>(bytes, 96);
  header.variable_records = number_at<std::uint32_t>(bytes, 100);
  const unsigned format = number_at<std::uint8_t>(bytes, 104);
  header.format = format & 0x3Fu;
  header.has_compressed_bits = (format & 0xC0u) != 0;
  header.record_size = number_at<std::uint16_t>(bytes, 105);
  header.count = number_at<std::uint32_t>(bytes, 107);
  header.scale = vector_at(bytes, 131);
  header.offset = vector_at(bytes, 155);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    header.max[Eigen::Index(axis)] = number_at<double>(bytes, 179 + 16 * axis);
    header.min[Eigen::Index(axis)] = number_at<double>(bytes, 187 + 16 * axis);
  }
  // Version 1.4 counts in 64 bits; files of 1.0 to 1.3 have points or other records there.
  if (header.size >= las_header_size_1_4 && bytes.size() >= las_header_size_1_4) {
    header.count = std::max(header.count, number_at<std::uint64_t>(bytes, 247));
    if (number_at<std::uint32_t>(bytes, 243) > 0) header.extended_at = number_at<std::uint64_t>(bytes, 235);
  }
  return header;
}

laszip_record parse_laszip(const file_bytes& file, std::string_view bytes) {
  constexpr std::size_t fixed_size = 34, item_size = 6;
  const std::size_t items = bytes.size() < fixed_size ? 0 : number_at<std::uint16_t>(bytes, 32);
  if (items == 0 || bytes.size() < fixed_size + item_size * items)
    file.fail("has a damaged LASzip record", "Copy or export the scan again");
  laszip_record record;
  record.compressor = number_at<std::uint16_t>(bytes, 0);
  record.chunk_size = number_at<std::uint32_t>(bytes, 12);
  for (std::size_t i = fixed_size; i < fixed_size + item_size * items; i += item_size)
    record.items.push_back({number_at<std::uint16_t>(bytes, i), number_at<std::uint16_t>(bytes, i + 2),
                            number_at<std::uint16_t>(bytes, i + 4)});
  return record;
}

std::vector<std::string> names_of_extra_bytes(std::string_view bytes) {
  constexpr std::size_t size = extra_description_size;
  std::vector<std::string> names;
  for (; bytes.size() >= size; bytes.remove_prefix(size)) names.emplace_back(text_at(bytes, 4, 32));
  return names;
}

}  // namespace

las_header read_las_header(const file_bytes& file) {
  const std::string bytes =
      read_text(file, 0, static_cast<std::size_t>(std::min<std::uint64_t>(file.size(), las_header_size_1_4)));
  if (bytes.size() < las_header_size_1_2) file.fail_truncated();
  const las_header header = parse_las_header(bytes);
  constexpr std::size_t shortest_record = 20;
  const bool scaled =
      header.scale.allFinite() && header.offset.allFinite() && (header.scale.array() != 0).all();
  if (header.size < las_header_size_1_2 || header.points_at < header.size || !scaled ||
      header.record_size < shortest_record)
    file.fail("has a damaged LAS header", "Copy or export the scan again");
  if (header.points_at > file.size()) file.fail_truncated();
  return header;
}

namespace {

bool is_padded_text(std::string_view field) {
  const std::string_view text = field.substr(0, field.find('\0'));
  const auto is_printable = [](char c) { return c >= ' ' && c <= '~'; };
  return std::all_of(text.begin(), text.end(), is_printable) &&
         field.find_first_not_of('\0', text.size()) == std::string_view::npos;
}

// Whether a record begins where the header says that the points do: its names tell it from points.
bool begins_record(const file_bytes& file, std::uint64_t offset) {
  if (offset > file.size() || file.size() - offset < record_header_size) return false;
  const std::string start = read_text(file, offset, record_header_size);
  const std::string_view user = std::string_view(start).substr(2, 16);
  return user[0] != '\0' && is_padded_text(user) && is_padded_text(std::string_view(start).substr(22, 32));
}

}  // namespace

las_records read_las_records(const file_bytes& file, const las_header& header) {
  las_records records;
  std::uint64_t offset = header.size;
  // Compressors leave a record of their own whatever number of records the header announces.
  for (std::uint32_t i = 0; i < header.variable_records || header.has_compressed_bits; ++i) {
    if (header.points_at - offset < record_header_size) {
      if (i < header.variable_records && begins_record(file, offset))
        file.fail("has a damaged LAS header: it says that points begin where there are other records",
                  "Copy or export the scan again");
      break;
    }
    const std::string start = read_text(file, offset, record_header_size);
    const std::string_view user = text_at(start, 2, 16);
    const auto number = number_at<std::uint16_t>(start, 18);
    const std::size_t size = number_at<std::uint16_t>(start, 20);
    offset += record_header_size;
    if (size > header.points_at - offset) break;
    const auto content = [&] { return read_text(file, offset, size); };
    if (user == "laszip encoded" && !records.laszip) records.laszip = parse_laszip(file, content());
    if (user == "LASF_Spec" && number == 4) records.extra_bytes = content();
    if (user == "LASF_Projection") records.projection.emplace_back(number, content());
    if (user == "copc" && number == 1) records.is_copc = true;
    offset += size;
  }
  if (header.has_compressed_bits && !records.laszip)
    file.fail("is compressed (LAZ), but does not say how: its LASzip record is missing",
              "Copy or export the scan again");
  return records;
}

std::string las_format_name(const las_header& header, const las_records& records) {
  const std::string version = "1." + std::to_string(header.minor_version);
  const std::string name = records.is_copc  ? "COPC 1.0"
                           : records.laszip ? "LAZ " + version
                                            : "LAS " + version;
  return name + ", point format " + std::to_string(header.format);
}

std::size_t las_format_size(unsigned format) {
  constexpr std::array<std::size_t, 11> sizes{20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
  return format < sizes.size() ? sizes[format] : 0;
}

std::vector<std::string> las_attributes(const las_header& header, const las_records& records) {
  std::vector<std::string> names{"intensity",           "return number",       "number of returns",
                                 "scan direction flag", "edge of flight line", "classification",
                                 "scan angle",          "user data",           "point source ID"};
  const unsigned format = header.format;
  const auto is_one_of = [&](std::initializer_list<unsigned> formats) {
    return std::find(formats.begin(), formats.end(), format) != formats.end();
  };
  if (format >= 6) names.insert(names.end(), {"scanner channel"});
  if (is_one_of({1, 3, 4, 5}) || format >= 6) names.insert(names.end(), {"GPS time"});
  if (is_one_of({2, 3, 5, 7, 8, 10})) names.insert(names.end(), {"red", "green", "blue"});
  if (is_one_of({8, 10})) names.insert(names.end(), {"near infrared"});
  if (is_one_of({4, 5, 9, 10})) names.insert(names.end(), {"wave packet"});
  const std::vector<std::string> extra = names_of_extra_bytes(records.extra_bytes);
  names.insert(names.end(), extra.begin(), extra.end());
  return names;
}

std::vector<record_field> las_record_fields(const las_header& header, const las_records& records) {
  std::vector<record_field> fields = las_fields(header.format);
  const std::size_t size = las_format_size(header.format);
  if (size == 0 || header.record_size < size) return {};
  const auto extra = extra_fields(records.extra_bytes, size, header.record_size);
  fields.insert(fields.end(), extra.begin(), extra.end());
  return fields;
}

}  // namespace globalmatch::support

// E57 files made by the tests, after the standard and without the code of the reader.
#pragma once

#include <Eigen/Geometry>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "e57_checksums.hpp"
#include "file_checks.hpp"

namespace globalmatch::support {

/// One field of a scan: how the prototype declares it, and the bits of its values.
struct written_field {
  std::string name;
  std::string declaration;
  unsigned bits;
  std::vector<std::uint64_t> raw;
};

struct written_scan {
  std::vector<written_field> fields;
  std::string pose = {};             ///< the element, or nothing
  std::size_t bytes_per_packet = 0;  ///< of the first field; more of the others; 0: all in one packet
  bool has_other_packets = true;     ///< to be passed over, between those of data
};

inline written_field float_field(std::string name, const std::vector<float>& values) {
  written_field field{std::move(name), "type=\"Float\" precision=\"single\"", 32, {}};
  for (const float value : values) field.raw.push_back(std::bit_cast<std::uint32_t>(value));
  return field;
}

inline written_field double_field(std::string name, const std::vector<double>& values) {
  written_field field{std::move(name), "type=\"Float\"", 64, {}};
  for (const double value : values) field.raw.push_back(std::bit_cast<std::uint64_t>(value));
  return field;
}

/// Integers in [minimum, maximum]; `more` may make them scaled ones.
inline written_field integer_field(std::string name, std::int64_t minimum, std::int64_t maximum,
                                   const std::vector<std::int64_t>& values,
                                   const std::string& more = "type=\"Integer\"") {
  const auto low = static_cast<std::uint64_t>(minimum), high = static_cast<std::uint64_t>(maximum);
  written_field field{
      std::move(name),
      more + " minimum=\"" + std::to_string(minimum) + "\" maximum=\"" + std::to_string(maximum) + "\"",
      static_cast<unsigned>(std::bit_width(high - low)),
      {}};
  for (const std::int64_t value : values) field.raw.push_back(static_cast<std::uint64_t>(value) - low);
  return field;
}

inline std::string e57_pose(const Eigen::Quaterniond& q, const Eigen::Vector3d& t) {
  const auto number = [](const char* name, double value) {
    char text[80];
    std::snprintf(text, sizeof text, "<%s type=\"Float\">%.17g</%s>", name, value, name);
    return std::string(text);
  };
  return "<pose type=\"Structure\"><rotation type=\"Structure\">" + number("w", q.w()) + number("x", q.x()) +
         number("y", q.y()) + number("z", q.z()) + "</rotation><translation type=\"Structure\">" +
         number("x", t.x()) + number("y", t.y()) + number("z", t.z()) + "</translation></pose>";
}

/// The values of a field one behind the other, the lowest bit first.
inline std::string packed(const written_field& field) {
  std::string bytes((field.raw.size() * field.bits + 7) / 8, '\0');
  std::size_t at = 0;
  for (const std::uint64_t value : field.raw)
    for (unsigned bit = 0; bit < field.bits; ++bit, ++at)
      if ((value >> bit & 1) != 0) bytes[at / 8] = static_cast<char>(bytes[at / 8] | 1 << at % 8);
  return bytes;
}

/// A packet of data; takes from the front of each stream what it holds.
inline std::string data_packet(std::vector<std::string>& streams, std::size_t bytes_per_packet) {
  std::string sizes, content;
  for (std::size_t i = 0; i < streams.size(); ++i) {
    const std::size_t size = std::min(streams[i].size(), bytes_per_packet + 3 * i);
    put<std::uint16_t>(sizes, static_cast<std::uint16_t>(size));
    content += streams[i].substr(0, size);
    streams[i].erase(0, size);
  }
  content.resize((content.size() + sizes.size() + 6 + 3) / 4 * 4 - sizes.size() - 6);
  std::string packet = {1, 0};
  put(packet, static_cast<std::uint16_t>(6 + sizes.size() + content.size() - 1));
  put(packet, static_cast<std::uint16_t>(streams.size()));
  return packet + sizes + content;
}

/// Content without the ends of pages: where a byte of it will be in the file.
inline std::uint64_t place_in_file(std::uint64_t offset) {
  return offset / 1020 * 1024 + offset % 1020;
}

/// The section of a scan that begins at `offset` of the content, with packets to pass over between those of
/// data.
inline std::string e57_section(const written_scan& scan, std::uint64_t offset) {
  std::vector<std::string> streams;
  for (const written_field& field : scan.fields) streams.push_back(packed(field));
  const std::size_t bytes = scan.bytes_per_packet == 0 ? 10'000 : scan.bytes_per_packet;
  std::string packets;
  while (std::any_of(streams.begin(), streams.end(), [](const std::string& s) { return !s.empty(); })) {
    packets += data_packet(streams, bytes);
    if (!scan.has_other_packets) continue;
    packets += std::string({2, 0, 7, 0, 1, 1, 1, 1});               // to be ignored, of 8 bytes
    packets += std::string({0, 0, 15, 0}) + std::string(12, '\0');  // an index without entries
  }
  std::string section(8, '\0');
  section[0] = 1;
  put<std::uint64_t>(section, 32 + packets.size());
  put<std::uint64_t>(section, place_in_file(offset + 32));
  put<std::uint64_t>(section, 0);
  return section + packets;
}

/// A file of these scans.
inline std::string e57_file(const std::vector<written_scan>& scans) {
  std::string content(48, '\0');
  std::string xml =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?><e57Root type=\"Structure\" "
      "xmlns=\"http://www.astm.org/COMMIT/E57/2010-e57-v1.0\"><formatName type=\"String\"><![CDATA[ASTM E57 "
      "3D "
      "Imaging Data File]]></formatName><guid type=\"String\"><![CDATA[{1}]]></guid><versionMajor "
      "type=\"Integer\">1</versionMajor><versionMinor type=\"Integer\"/>"
      "<data3D type=\"Vector\" allowHeterogeneousChildren=\"1\">";
  for (const written_scan& scan : scans) {
    const std::size_t size = scan.fields.front().raw.size();
    xml += "<vectorChild type=\"Structure\"><guid type=\"String\"><![CDATA[{2}]]></guid>" + scan.pose +
           "<points type=\"CompressedVector\" fileOffset=\"" + std::to_string(place_in_file(content.size())) +
           "\" recordCount=\"" + std::to_string(size) + "\"><prototype type=\"Structure\">";
    for (const written_field& field : scan.fields) xml += "<" + field.name + " " + field.declaration + "/>";
    xml += "</prototype><codecs type=\"Vector\" allowHeterogeneousChildren=\"1\"/></points></vectorChild>";
    content += e57_section(scan, content.size());
  }
  xml += "</data3D><images2D type=\"Vector\" allowHeterogeneousChildren=\"1\"/></e57Root>";
  content.replace(0, 8, "ASTM-E57");
  put_at<std::uint32_t>(content, 8, 1);
  put_at<std::uint64_t>(content, 24, place_in_file(content.size()));
  put_at<std::uint64_t>(content, 32, xml.size());
  put_at<std::uint64_t>(content, 40, 1024);
  content += xml;
  content.resize((content.size() + 1019) / 1020 * 1020);
  put_at<std::uint64_t>(content, 16, content.size() / 1020 * 1024);
  std::string file;
  for (std::size_t page = 0; page < content.size(); page += 1020)
    file += content.substr(page, 1020) + std::string(4, '\0');
  seal_pages(file);
  return file;
}

}  // namespace globalmatch::support

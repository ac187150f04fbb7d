// What the tests of writers share: LAS files of made records, and the attributes of scans.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "file_checks.hpp"
#include "made_las_records.hpp"
#include "support/las_header.hpp"
#include "support/scan_writer.hpp"

namespace globalmatch::support {

/// A LAS file that is not compressed, of these records.
inline std::string las_bytes(unsigned format, std::size_t record_size, const std::string& records) {
  const std::size_t size = format < 6 ? 227 : 375, count = records.size() / record_size;
  std::string bytes(size, '\0');
  bytes.replace(0, 4, "LASF");
  bytes[6] = 1;  // adjusted standard GPS time
  bytes[24] = 1;
  bytes[25] = format < 6 ? 2 : 4;
  put_at(bytes, 94, static_cast<std::uint16_t>(size));
  put_at(bytes, 96, static_cast<std::uint32_t>(size));
  bytes[104] = static_cast<char>(format);
  put_at(bytes, 105, static_cast<std::uint16_t>(record_size));
  if (format < 6)
    put_at(bytes, 107, static_cast<std::uint32_t>(count));
  else
    put_at(bytes, 247, static_cast<std::uint64_t>(count));
  const double numbers[] = {0.001, 0.001, 0.01, -500'000, 5'000'000, 100};
  for (std::size_t i = 0; i < 6; ++i) put_at(bytes, 131 + 8 * i, numbers[i]);
  return bytes + records;
}

/// Of made points, four scanner channels of which take turns.
inline std::string made_las_bytes(unsigned format, std::size_t extra_bytes, std::uint32_t count) {
  std::string records;
  for (std::uint32_t i = 0; i < count; ++i) records += made_record(format, extra_bytes, format >= 6, i);
  return las_bytes(format, las_format_size(format) + extra_bytes, records);
}

/// The stored numbers of an attribute, all of them, read in runs that blocks do not divide.
inline std::string numbers_of(const scan_file& scan, const std::string& name, std::size_t run = 3000) {
  const std::vector<attribute> all = scan.points().attributes();
  std::size_t index = 0;
  while (index < all.size() && all[index].name != name) ++index;
  INFO(name);
  REQUIRE(index < all.size());
  std::string numbers;
  for (std::size_t first = 0; first < scan.size(); first += run) {
    attribute_column column{index, {}};
    scan.points().read_attributes(first, std::min(run, scan.size() - first), {&column, 1});
    numbers.append(column.numbers.begin(), column.numbers.end());
  }
  return numbers;
}

/// The values of an attribute.
inline std::vector<double> values_of(const scan_file& scan, const std::string& name) {
  const std::string numbers = numbers_of(scan, name);
  std::vector<double> values;
  for (const attribute& a : scan.points().attributes())
    if (a.name == name)
      for (std::size_t at = 0; at < numbers.size(); at += size_of(a.type))
        values.push_back(load(a.type, numbers.data() + at, std::endian::native) * a.scale + a.offset);
  return values;
}

/// Writes one scan where it is.
inline void write_scan(const std::filesystem::path& path, const scan_file& scan, int threads = 1) {
  const placed_scan placed{&scan, Eigen::Isometry3d::Identity(), {1, 2, 3}};
  write_scans(path, {&placed, 1}, threads);
}

}  // namespace globalmatch::support

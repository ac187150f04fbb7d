#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "catch.hpp"
#include "las_checks.hpp"

namespace globalmatch::support::test_las_files {

namespace {

constexpr std::uint16_t header_size_1_2 = 227;
constexpr std::uint16_t header_size_1_4 = 375;
constexpr std::uint16_t record_size = 34;
constexpr std::size_t at_points = 96, at_variable_records = 100, at_format = 104, at_record_size = 105,
                      at_count = 107, at_scale = 131, at_offset = 155, at_count_1_4 = 247;

// Two points, (1.01, 502, -3) and (1, 500, 0), behind `gap` other bytes.
std::string las(std::uint16_t header_size, std::uint8_t format, std::uint32_t legacy_count,
                const std::string& gap = "") {
  std::string bytes(header_size, '\0');
  bytes.replace(0, 4, "LASF");
  put_at(bytes, 24, std::uint8_t(1));
  put_at(bytes, 25, std::uint8_t(header_size == header_size_1_4 ? 4 : 2));
  put_at(bytes, 94, header_size);
  put_at(bytes, at_points, static_cast<std::uint32_t>(header_size + gap.size()));
  put_at(bytes, at_format, format);
  put_at(bytes, at_record_size, record_size);
  put_at(bytes, at_count, legacy_count);
  const double scale[] = {0.01, 0.5, 1}, offset[] = {1, 500, 0};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    put_at(bytes, at_scale + 8 * axis, scale[axis]);
    put_at(bytes, at_offset + 8 * axis, offset[axis]);
  }
  bytes += gap;
  for (const auto& record : {std::array{1, 4, -3}, std::array{0, 0, 0}}) {
    for (const int coordinate : record) put(bytes, std::int32_t(coordinate));
    bytes += std::string(record_size - 12, '\x00');  // class 0, no flags
  }
  return bytes;
}

std::string variable_record(const std::string& user) {
  std::string record(54 + 10, '\0');
  record.replace(2, user.size(), user);
  put_at(record, 20, std::uint16_t(10));
  return record;
}

const auto read_file = [](const std::filesystem::path& path) { read_las_file(path); };

void require_two_points(const std::filesystem::path& path) {
  const points read = read_las_file(path);
  REQUIRE(read.size() == 2);
  CHECK((read[0] - Eigen::Vector3d(1.01, 502, -3)).norm() < 1e-12);
  CHECK((read[1] - Eigen::Vector3d(1, 500, 0)).norm() < 1e-12);
}

}  // namespace

TEST_CASE("LAS coordinates are scaled and shifted, for every point format") {
  const temporary_directory directory;
  for (std::uint8_t format = 0; format <= 10; ++format)
    require_two_points(directory.file("a.las", las(header_size_1_2, format, 2)));
}

TEST_CASE("the 64-bit point count of LAS 1.4 is read") {
  const temporary_directory directory;
  std::string bytes = las(header_size_1_4, 6, 0);
  put_at(bytes, at_count_1_4, std::uint64_t(2));
  require_two_points(directory.file("a.las", bytes));
  require_two_points(directory.file("legacy.las", las(header_size_1_4, 3, 2)));
}

TEST_CASE("records between the LAS header and its points are passed over") {
  const temporary_directory directory;
  std::string bytes = las(header_size_1_2, 3, 2, variable_record("LASF_Projection") + "padding");
  put_at(bytes, at_variable_records, std::uint32_t(1));
  require_two_points(directory.file("a.las", bytes));
}

TEST_CASE("LAS points of the noise classes or withheld are left out and counted, or read on request") {
  const temporary_directory directory;
  for (const std::uint8_t format : {std::uint8_t(0), std::uint8_t(5), std::uint8_t(6), std::uint8_t(10)}) {
    const bool is_long = format >= 6;
    for (const std::uint8_t noise : {std::uint8_t(7), std::uint8_t(18)}) {
      std::string bytes = las(header_size_1_2, format, 2);
      put_at(bytes, header_size_1_2 + (is_long ? 16 : 15), noise);
      put_at(bytes, header_size_1_2 + record_size + 15, std::uint8_t(is_long ? 0x04 : 0x80));
      const auto file = directory.file("a.las", bytes);
      CHECK(read_las_file(file).empty());
      CHECK(read_las_file(file, {.keep_marked = true}).size() == 2);
      const opened_scan scan = open_las_file(file);
      CHECK(scan.points->size() == 2);
      all_points(*scan.points, 1);  // no whole block
      CHECK(scan.points->marked().noise == 0);
      for (int pass = 0; pass < 2; ++pass) all_points(*scan.points);
      CHECK(scan.points->marked().noise == 1);
      CHECK(scan.points->marked().withheld == 1);
    }
    std::string ground = las(header_size_1_2, format, 2);
    put_at(ground, header_size_1_2 + (is_long ? 16 : 15), std::uint8_t(2));
    require_two_points(directory.file("ground.las", ground));
  }
}

TEST_CASE("a LAS file without points is an empty scan, and one that does not count them has all there are") {
  const temporary_directory directory;
  CHECK(read_las_file(directory.file("a.las", las(header_size_1_2, 0, 0))).size() == 2);
  std::string odd = las(header_size_1_2, 0, 0);
  odd.pop_back();
  CHECK(read_las_file(directory.file("odd.las", odd)).size() == 1);
  CHECK(
      read_las_file(directory.file("b.las", las(header_size_1_2, 0, 0).substr(0, header_size_1_2))).empty());
}

TEST_CASE("a LAS file that counts no points or too few is read, and that is noted") {
  const temporary_directory directory;
  const auto notes_of = [&](const std::string& bytes) {
    return open_scan(directory.file("a.las", bytes)).header().notes;
  };
  CHECK(notes_of(las(header_size_1_2, 3, 2)).empty());
  CHECK(notes_of(las(header_size_1_2, 3, 2) + "tail").empty());
  const std::string uncounted = las(header_size_1_2, 3, 0);
  for (const std::string& bytes :
       {uncounted, uncounted + std::string(record_size - 1, '\x01'), uncounted + "tail"}) {
    require_two_points(directory.file("a.las", bytes));
    REQUIRE(notes_of(bytes).size() == 1);
    CHECK(notes_of(bytes)[0].find("announces no points") != std::string::npos);
  }
  CHECK(read_las_file(directory.file("a.las", uncounted.substr(0, uncounted.size() - 1))).size() == 1);
  const std::string too_few = las(header_size_1_2, 3, 1);
  CHECK(read_las_file(directory.file("a.las", too_few)).size() == 1);
  REQUIRE(notes_of(too_few).size() == 1);
  CHECK(notes_of(too_few)[0].find("announces 1 points, and the file holds bytes of 1 more") !=
        std::string::npos);
  std::string wave_packets = too_few;
  put_at(wave_packets, 6, std::uint16_t(2));
  CHECK(notes_of(wave_packets).empty());
}

TEST_CASE("LAS points that begin where records do are refused, and a box that contradicts points is noted") {
  const temporary_directory directory;
  for (const char* user : {"x", "LASF_Projection"}) {
    std::string bytes = las(header_size_1_2, 3, 2, variable_record(user));
    put_at(bytes, at_variable_records, std::uint32_t(1));
    put_at(bytes, at_points, std::uint32_t(header_size_1_2));
    require_error(directory.file("a.las", bytes), read_file, "where there are other records",
                  "Copy or export");
  }
  const auto notes_for_box = [&](double min, double max) {
    std::string bytes = las(header_size_1_2, 3, 2);
    for (const std::size_t at : {179u, 195u, 211u}) {
      put_at(bytes, at, max);
      put_at(bytes, at + 8, min);
    }
    return open_scan(directory.file("a.las", bytes)).header().notes.size();
  };
  CHECK(notes_for_box(2000, 3000) == 1);
  CHECK(notes_for_box(-1000, 1000) == 0);
  CHECK(notes_for_box(450, 1000) == 0);  // off by no more than its size
  CHECK(notes_for_box(0, 0) == 0);
  CHECK(notes_for_box(1000, -1000) == 0);
  CHECK(notes_for_box(std::numeric_limits<double>::quiet_NaN(), 1) == 0);
}

TEST_CASE("a LAS file that announces more variable records than it has is read") {
  const temporary_directory directory;
  std::string bytes = las(header_size_1_2, 0, 2, variable_record("other"));
  put_at(bytes, at_variable_records, std::uint32_t(40));
  CHECK(read_las_file(directory.file("a.las", bytes)).size() == 2);
}

TEST_CASE("a LAS header names the format, and a record the extra bytes") {
  const temporary_directory directory;
  std::string extra(192, '\0');
  extra.replace(4, 9, "amplitude");
  std::string record = variable_record("LASF_Spec").substr(0, 54) + extra;
  put_at(record, 18, std::uint16_t(4));
  put_at(record, 20, std::uint16_t(192));
  std::string bytes = las(header_size_1_2, 3, 2, record);
  put_at(bytes, at_variable_records, std::uint32_t(1));
  const scan_header header = open_las_file(directory.file("a.las", bytes)).header;
  CHECK(header.format == "LAS 1.2, point format 3");
  CHECK(header.attributes.front() == "intensity");
  CHECK(header.attributes.back() == "amplitude");
  CHECK(std::count(header.attributes.begin(), header.attributes.end(), "GPS time") == 1);
  CHECK(open_las_file(directory.file("b.las", las(header_size_1_4, 6, 2))).header.format ==
        "LAS 1.4, point format 6");
}

TEST_CASE("marked points are counted once, in blocks that were read whole") {
  const temporary_directory directory;
  std::string bytes = las(header_size_1_2, 0, 0);
  std::string record(record_size, '\0');
  record[15] = 7;
  constexpr std::size_t block = point_source::block_size, count = 2 * block + 500;
  bytes.resize(header_size_1_2);
  for (std::size_t i = 0; i < count; ++i) bytes += record;
  const opened_scan scan = open_las_file(directory.file("a.las", bytes));
  REQUIRE(scan.points->size() == count);
  points some(count - block + 24);
  scan.points->read(500, std::span(some).first(block));
  CHECK(scan.points->marked().noise == 0);
  scan.points->read(block - 24, some);
  CHECK(scan.points->marked().noise == count - block);
  for (int pass = 0; pass < 2; ++pass) all_points(*scan.points, 2 * block + 100);
  CHECK(scan.points->marked().noise == count);
  CHECK(some.front().hasNaN());
}

TEST_CASE("a LAS file that claims to be compressed without saying how is refused") {
  const temporary_directory directory;
  for (const std::uint8_t format : {std::uint8_t(0x80 | 3), std::uint8_t(0x40 | 1)})
    require_error(directory.file("a.laz", las(header_size_1_2, format, 2, variable_record("other"))),
                  read_file, "LASzip record is missing", "again");
}

TEST_CASE("a LAS file that announces more than it holds is refused before anything is allocated") {
  const temporary_directory directory;
  require_error(directory.file("a.las", las(header_size_1_2, 0, 3)), read_file, "ends before", "again");
  require_error(directory.file("b.las", las(header_size_1_2, 0, 4'000'000'000u)), read_file, "ends before",
                "again");
  std::string bytes = las(header_size_1_4, 6, 0);
  put_at(bytes, at_count_1_4, std::uint64_t(1'000'000'000'000'000'000u));
  require_error(directory.file("c.las", bytes), read_file, "ends before", "again");
  bytes = las(header_size_1_2, 0, 2);
  put_at(bytes, at_points, std::uint32_t(4'000'000'000u));
  require_error(directory.file("d.las", bytes), read_file, "ends before", "again");
}

TEST_CASE("each prefix of a LAS file is refused") {
  const temporary_directory directory;
  const std::string whole = las(header_size_1_2, 0, 2);
  for (std::size_t size = 4; size < whole.size(); ++size) {
    const auto path = directory.file("part.las", whole.substr(0, size));
    CHECK(error_of([&] { read_las_file(path); }).find("part.las") != std::string::npos);
  }
}

TEST_CASE("a LAS header that makes no sense is refused") {
  const temporary_directory directory;
  const auto require_damaged = [&](std::size_t offset, auto value) {
    std::string bytes = las(header_size_1_2, 0, 2);
    put_at(bytes, offset, value);
    require_error(directory.file("a.las", bytes), read_file, "damaged LAS header", "again");
  };
  require_damaged(at_scale, 0.0);
  require_damaged(at_offset, std::numeric_limits<double>::quiet_NaN());
  require_damaged(at_record_size, std::uint16_t(0));
  require_damaged(at_record_size, std::uint16_t(11));
  require_damaged(at_points, std::uint32_t(100));
}

}  // namespace globalmatch::support::test_las_files

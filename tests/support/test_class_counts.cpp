#include "support/class_counts.hpp"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>

#include "catch.hpp"
#include "las_checks.hpp"
#include "made_las_records.hpp"

namespace globalmatch::support::test_class_counts {

namespace {

constexpr std::uint32_t made_points = 250;

struct made_file {
  std::string name;
  unsigned format;
  std::size_t extra_bytes;
  bool has_channels;
};

const made_file made_files[] = {{"format_0", 0, 0, false},          {"format_1_extra", 1, 3, false},
                                {"format_3_variable", 3, 2, false}, {"format_6", 6, 0, false},
                                {"format_7_extra", 7, 2, true},     {"format_8_version_4", 8, 2, true}};

/// By the definition of the records.
class_counts count_made(const made_file& made) {
  class_counts counts;
  for (std::uint32_t i = 0; i < made_points; ++i) {
    const std::string record = made_record(made.format, made.extra_bytes, made.has_channels, i);
    const auto byte = [&](std::size_t at) { return unsigned(static_cast<unsigned char>(record[at])); };
    const made_point p(i);
    counts.add(p.number, p.count, made.format < 6 ? byte(15) % 32 : byte(16));
  }
  return counts;
}

/// A file of `count` binary vertices: return number as a float, class as a byte.
std::string ply(std::size_t count, const std::string& properties) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(count) +
                      "\nproperty float x\nproperty float y\nproperty float z\n" + properties +
                      "end_header\n";
  for (std::size_t i = 0; i < count; ++i) {
    for (int axis = 0; axis < 3; ++axis) put(bytes, float(i));
    put(bytes, float(1 + i % 3));
    put(bytes, std::uint8_t(i % 7));
  }
  return bytes;
}

}  // namespace

TEST_CASE("returns and classes of LAZ points are those of their records, streamed or not") {
  for (const made_file& made : made_files) {
    INFO(made.name);
    const auto path = std::filesystem::path(GLOBALMATCH_TEST_DATA) / (made.name + ".laz");
    for (const std::uint64_t memory : {std::uint64_t(0), std::uint64_t(1) << 30}) {
      const opened_scan scan = open_las_file(path, {.memory = memory});
      for (const int threads : {1, 3})
        CHECK(scan.points->count_classes({.threads = threads}) == count_made(made));
    }
  }
}

TEST_CASE("returns and classes of LAS points are counted, also of noise") {
  const temporary_directory directory;
  for (const unsigned format : {1u, 6u}) {
    std::string bytes(375, '\0');
    bytes.replace(0, 4, "LASF");
    put_at(bytes, 24, std::uint8_t(1));
    put_at(bytes, 25, std::uint8_t(4));
    put_at(bytes, 94, std::uint16_t(375));
    put_at(bytes, 96, std::uint32_t(375));
    put_at(bytes, 104, std::uint8_t(format));
    const std::string record = made_record(format, 0, false, 0);
    put_at(bytes, 105, static_cast<std::uint16_t>(record.size()));
    put_at(bytes, 247, std::uint64_t(40 * made_points));
    for (const std::size_t axis : {0u, 1u, 2u}) put_at(bytes, 131 + 8 * axis, 0.001);
    class_counts expected;
    for (int k = 0; k < 40; ++k) {
      expected += count_made({"", format, 0, false});
      for (std::uint32_t i = 0; i < made_points; ++i) bytes += made_record(format, 0, false, i);
    }
    CHECK(expected.classes[7] > 0);
    const scan_file scan = open_scan(directory.file("a.las", bytes));
    for (const int threads : {1, 3}) CHECK(scan.points().count_classes({.threads = threads}) == expected);
  }
}

TEST_CASE("returns and classes of binary PLY are counted where its properties are named so") {
  const temporary_directory directory;
  const auto count = [&](const std::string& properties) {
    return open_scan(directory.file("a.ply", ply(10'500, properties))).points().count_classes({});
  };
  const auto named = count("property float scalar_Return_Number\nproperty uchar classification\n");
  REQUIRE(named);
  CHECK(named->return_numbers[3] == 3500);
  CHECK(named->classes[6] == 1500);
  CHECK(named->return_counts == class_counts{}.return_counts);
  CHECK_FALSE(count("property float a\nproperty uchar b\n"));
  CHECK(count("property float NumberOfReturns\nproperty uchar b\n")->return_counts[1] == 3500);
  CHECK(count("property float a\nproperty uchar class\n")->classes[6] == 1500);
}

TEST_CASE("classes of binary PCD are counted") {
  const temporary_directory directory;
  std::string bytes =
      "VERSION 0.7\nFIELDS x y z Classification\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 1\nPOINTS 700\n"
      "DATA binary\n";
  for (int i = 0; i < 700; ++i) {
    for (int axis = 0; axis < 3; ++axis) put(bytes, float(i));
    put(bytes, std::uint8_t(i % 7));
  }
  class_counts expected;
  std::fill_n(expected.classes.begin(), 7, std::size_t(100));
  CHECK(open_scan(directory.file("a.pcd", bytes)).points().count_classes({}) == expected);
}

TEST_CASE("values that are no return number or class are not counted") {
  const temporary_directory directory;
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
      "property float z\nproperty float classification\nend_header\n";
  for (const float value : {-1.0f, 256.0f, std::numeric_limits<float>::quiet_NaN(), 1e30f, 255.0f})
    for (const float f : {0.0f, 0.0f, 0.0f, value}) put(bytes, f);
  const auto counts = open_scan(directory.file("a.ply", bytes)).points().count_classes({});
  class_counts expected;
  expected.classes[255] = 1;
  CHECK(counts == expected);
}

TEST_CASE("counts of tiles are added, and a scan without returns and classes has none") {
  const temporary_directory directory;
  const auto data = std::filesystem::path(GLOBALMATCH_TEST_DATA);
  std::filesystem::copy(data / "format_0.laz", directory / "a.laz");
  std::filesystem::copy(data / "format_6.laz", directory / "b.laz");
  directory.file("c.xyz", "1 2 3\n");
  const auto open = [&] { return open_scan(directory.path(), {.tiles = true}); };
  class_counts expected = count_made(made_files[0]);
  expected += count_made(made_files[3]);
  CHECK(open().points().count_classes({}) == expected);
  CHECK_FALSE(open_scan(directory / "c.xyz").points().count_classes({}));
}

TEST_CASE("damage that shows while returns and classes are counted is an error") {
  const temporary_directory directory;
  for (const char* name : {"format_0.laz", "format_6.laz"}) {
    std::string bytes = bytes_of(std::filesystem::path(GLOBALMATCH_TEST_DATA) / name);
    const auto path = directory.file(name, bytes);
    const opened_scan scan = open_las_file(path);
    std::filesystem::resize_file(path, 700);
    require_error(
        path, [&](const auto&) { scan.points->count_classes({}); }, "ends before", "again");
  }
}

}  // namespace globalmatch::support::test_class_counts

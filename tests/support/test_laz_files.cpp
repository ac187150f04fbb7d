#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "catch.hpp"
#include "las_checks.hpp"
#include "made_las_records.hpp"
#include "support/scalars.hpp"

namespace globalmatch::support::test_laz_files {

namespace {

struct made_file {
  std::string name;
  unsigned format;
  std::size_t extra_bytes;
  bool has_channels;
  unsigned version;  // of layers
};

const std::vector<made_file> made_files{
    {"format_0", 0, 0, false, 0},          {"format_1_extra", 1, 3, false, 0},
    {"format_2", 2, 0, false, 0},          {"format_3_variable", 3, 2, false, 0},
    {"format_3_streamed", 3, 0, false, 0}, {"format_6", 6, 0, false, 3},
    {"format_7_extra", 7, 2, true, 3},     {"format_8_variable", 8, 2, true, 3},
    {"format_8_version_4", 8, 2, true, 4},
};

constexpr std::uint32_t made_points = 250;
constexpr std::size_t at_variable_records = 100, at_count = 107, at_count_1_4 = 247;
constexpr std::size_t laszip_header = 54;

std::filesystem::path path_of(const made_file& made) {
  return std::filesystem::path(GLOBALMATCH_TEST_DATA) / (made.name + ".laz");
}

std::size_t header_size(const made_file& made) {
  return made.format < 6 ? 227 : 375;
}

// Where the points of a made file begin: the only record is that of LASzip.
std::size_t points_at(const std::string& bytes) {
  return load<std::uint32_t>(bytes.data() + 96, std::endian::little);
}

Eigen::Vector3d made_position(std::uint32_t i) {
  const made_point p(i);
  return {static_cast<std::int32_t>(p.x) * 0.001 - 500'000,
          static_cast<std::int32_t>(p.y) * 0.001 + 5'000'000, static_cast<std::int32_t>(p.z) * 0.01 + 100};
}

points made_positions() {
  points positions;
  for (std::uint32_t i = 0; i < made_points; ++i) positions.push_back(made_position(i));
  return positions;
}

const auto read_file = [](const std::filesystem::path& path) { read_las_file(path); };

}  // namespace

TEST_CASE("compressed points are those that were compressed, decoded at once or when asked for") {
  for (const made_file& made : made_files)
    for (const std::uint64_t memory : {std::uint64_t(1) << 30, std::uint64_t(0)})
      for (const int threads : {1, 3}) {
        INFO(made.name << ", memory " << memory << ", threads " << threads);
        const opened_scan scan =
            open_las_file(path_of(made), {.keep_marked = true, .threads = threads, .memory = memory});
        CHECK(all_points(*scan.points, 70) == made_positions());
        CHECK(all_points(*scan.points) == made_positions());
      }
}

TEST_CASE("whole records are decoded of each format") {
  for (const made_file& made : made_files) {
    INFO(made.name);
    std::string expected;
    for (std::uint32_t i = 0; i < made_points; ++i)
      expected += made_record(made.format, made.extra_bytes, made.has_channels, i);
    CHECK(decoded_records(path_of(made)) == expected);
  }
}

TEST_CASE("compressed points that are marked are left out and counted once") {
  for (const made_file& made : made_files) {
    INFO(made.name);
    const opened_scan scan = open_las_file(path_of(made));
    std::size_t noise = 0, withheld = 0;
    for (std::uint32_t i = 0; i < made_points; ++i) {
      const std::string record = made_record(made.format, made.extra_bytes, made.has_channels, i);
      const unsigned number = record[made.format < 6 ? 15 : 16] & 0x1F;
      const bool is_noise = number == 7 || number == 18;
      const bool is_withheld = (record[15] & (made.format < 6 ? 0x80 : 0x04)) != 0;
      noise += is_noise;
      withheld += is_withheld && !is_noise;
    }
    points read;
    for (int pass = 0; pass < 2; ++pass) read = all_points(*scan.points);
    CHECK(scan.points->marked().noise == noise);
    CHECK(scan.points->marked().withheld == withheld);
    CHECK(read_las_file(path_of(made)).size() == made_points - noise - withheld);
  }
}

TEST_CASE("the format of a compressed file is named, whatever number of records it announces") {
  const temporary_directory directory;
  std::string bytes = bytes_of(path_of(made_files[6]));
  CHECK(open_las_file(path_of(made_files[6])).header.format == "LAZ 1.4, point format 7");
  put_at(bytes, at_variable_records, std::uint32_t(0));
  const auto attributes = open_las_file(directory.file("a.laz", bytes)).header.attributes;
  CHECK(std::count(attributes.begin(), attributes.end(), "blue") == 1);
}

TEST_CASE("chunks are found without their table, if the format allows it") {
  const temporary_directory directory;
  for (const made_file& made : made_files) {
    INFO(made.name);
    const std::string whole = bytes_of(path_of(made));
    std::string interrupted = whole;  // the compressor did not come to write where the table is
    const std::size_t at = points_at(whole);
    put_at(interrupted, at, std::uint64_t(at));
    std::string damaged = whole;
    const bool is_at_end = load<std::int64_t>(whole.data() + at, std::endian::little) == -1;
    const auto table_at = static_cast<std::size_t>(
        load<std::uint64_t>(whole.data() + (is_at_end ? whole.size() - 8 : at), std::endian::little));
    put_at(damaged, table_at + 4, std::uint32_t(77));
    for (const std::string& bytes : {interrupted, damaged, whole.substr(0, table_at)}) {
      const auto file = directory.file("a.laz", bytes);
      if (made.name == "format_3_variable")
        require_error(file, read_file, "lost the table", "again");
      else
        CHECK(read_las_file(file, {.keep_marked = true}) == made_positions());
    }
  }
}

TEST_CASE("files that are compressed in a way that is not read are refused by name") {
  const temporary_directory directory;
  const auto require_refused = [&](const made_file& made, std::size_t offset, std::uint16_t value,
                                   const std::string& problem) {
    std::string bytes = bytes_of(path_of(made));
    put_at(bytes, header_size(made) + laszip_header + offset, value);
    const auto laz = directory.file("a.laz", bytes);
    const std::string names = '"' + laz.string() + "\" ";
    const std::string out = '"' + (directory / "a.las").string() + '"';
    require_error(laz, read_file, problem, "las2las -i " + names + "-o " + out);
    require_error(laz, read_file, problem, "pdal translate " + names + out);
  };
  constexpr std::size_t at_compressor = 0, at_first_version = 38;
  require_refused(made_files[0], at_compressor, 1, "point by point");
  require_refused(made_files[0], at_compressor, 7, "unknown way");
  require_refused(made_files[0], at_first_version, 1, "unknown version");
  require_refused(made_files[5], at_first_version, 5, "unknown version");
  std::string wave = bytes_of(path_of(made_files[0]));
  put_at(wave, 104, std::uint8_t(0x80 | 4));
  require_error(directory.file("b.las", wave), read_file, "wave packets",
                (directory / "b.uncompressed.las").string());
}

TEST_CASE("a compressed file with chunks behind the points that it announces is read, and that is noted") {
  const temporary_directory directory;
  for (const made_file& made : made_files) {
    INFO(made.name);
    CHECK(open_las_file(path_of(made)).header.notes.empty());
    std::string bytes = bytes_of(path_of(made));
    put_at(bytes, at_count, std::uint32_t(1));
    if (made.format >= 6) put_at(bytes, at_count_1_4, std::uint64_t(1));
    const opened_scan scan = open_las_file(directory.file("a.laz", bytes));
    CHECK(scan.points->size() == 1);
    REQUIRE(scan.header.notes.size() == 1);
    CHECK(scan.header.notes[0].find("announces 1 points") != std::string::npos);
  }
}

TEST_CASE("a compressed file that announces more points than it holds is refused") {
  const temporary_directory directory;
  for (const made_file& made : made_files) {
    std::string bytes = bytes_of(path_of(made));
    put_at(bytes, at_count, std::uint32_t(4'000'000'000u));
    if (made.format >= 6) put_at(bytes, at_count_1_4, std::uint64_t(1) << 60);
    CHECK_FALSE(error_of([&] { read_las_file(directory.file("a.laz", bytes)); }).empty());
  }
}

TEST_CASE("a prefix of a compressed file, and one with a wrong byte, has points or an error") {
  const temporary_directory directory;
  for (const made_file& made : made_files) {
    const std::string whole = bytes_of(path_of(made));
    const auto read_any = [&](const std::string& bytes, std::uint64_t memory) {
      const auto path = directory.file("part.laz", bytes);
      try {
        read_las_file(path, {.threads = 1, .memory = memory});
      } catch (const file_error& error) {
        CHECK(std::string(error.what()).find("part.laz") != std::string::npos);
      }
    };
    for (std::size_t size = 0; size < whole.size(); size += 47)
      read_any(whole.substr(0, size), size % 2 << 20);
    // Many bytes of the headers, and some of the compressed ones.
    for (std::size_t at = 90; at < whole.size(); at += at < points_at(whole) + 60 ? 3 : 41) {
      std::string bytes = whole;
      bytes[at] = static_cast<char>(bytes[at] ^ (at % 2 == 0 ? 0xFF : 1 << at % 8));
      read_any(bytes, at % 2 << 20);
    }
  }
}

}  // namespace globalmatch::support::test_laz_files

#include "support/e57.hpp"

#include <cmath>
#include <limits>
#include <random>

#include "catch.hpp"
#include "e57_checks.hpp"
#include "e57_writer.hpp"
#include "file_checks.hpp"

namespace globalmatch::support::test_e57_files {

namespace {

points read_points(const point_source& source) {
  points all(source.size());
  source.read(0, all);
  return all;
}

points read_e57(const std::filesystem::path& path) {
  return read_points(*open_e57_file(path, 1).points);
}

std::vector<std::int64_t> random_integers(std::mt19937& random, std::size_t count, std::int64_t minimum,
                                          std::int64_t maximum) {
  std::vector<std::int64_t> values(count);
  for (auto& value : values) value = std::uniform_int_distribution<std::int64_t>(minimum, maximum)(random);
  return values;
}

/// A scan of all types of numbers, and its points.
written_scan mixed_scan(std::size_t count, std::size_t bytes_per_packet, points& expected) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> coordinate(-50, 50);
  std::vector<float> x(count);
  for (float& value : x) value = coordinate(random);
  const auto y = random_integers(random, count, -1000, 130'000);
  std::vector<double> z(count);
  for (double& value : z) value = static_cast<double>(coordinate(random)) / 3;
  written_scan scan;
  scan.fields = {
      integer_field("intensity", 0, 2047, random_integers(random, count, 0, 2047)),
      float_field("cartesianX", x),
      integer_field("cartesianY", -1000, 130'000, y, "type=\"ScaledInteger\" scale=\"0.001\" offset=\"7.5\""),
      integer_field("colorRed", 0, 255, random_integers(random, count, 0, 255)),
      double_field("cartesianZ", z)};
  scan.bytes_per_packet = bytes_per_packet;
  expected.clear();
  for (std::size_t i = 0; i < count; ++i)
    expected.emplace_back(static_cast<double>(x[i]), static_cast<double>(y[i]) * 0.001 + 7.5, z[i]);
  return scan;
}

bool is_nan(const Eigen::Vector3d& p) {
  return p.array().isNaN().all();
}

}  // namespace

TEST_CASE("an E57 scan is read whatever packets cut its fields") {
  const temporary_directory directory;
  const std::size_t bytes_per_packet = GENERATE(1u, 7u, 64u, 1000u, 10'000u);
  points expected;
  const auto path = directory.file("a.e57", e57_file({mixed_scan(3000, bytes_per_packet, expected)}));
  CHECK(looks_like_e57(bytes_of(path)));
  CHECK(count_scans_of(path) == 1);
  const opened_scan scan = open_e57_file(path, 1);
  CHECK(read_points(*scan.points) == expected);
  CHECK(scan.header.format == "E57 1.0");
  CHECK(scan.header.attributes == std::vector<std::string>{"intensity", "colorRed"});
  CHECK_FALSE(scan.header.pose);
  CHECK(scan.header.notes.empty());
}

TEST_CASE("an E57 scan that holds more points than it announces is read as announced, and that is noted") {
  const temporary_directory directory;
  for (const std::size_t bytes_per_packet : {std::size_t(64), std::size_t(10'000)})
    for (const std::string count : {"0008", "2000", "2980"}) {
      points expected;
      std::string bytes = e57_file({mixed_scan(3000, bytes_per_packet, expected)});
      bytes.replace(bytes.find("recordCount=\"3000\"") + 13, 4, count);
      seal_pages(bytes);
      const opened_scan scan = open_e57_file(directory.file("a.e57", bytes), 1);
      expected.resize(scan.points->size());
      CHECK(scan.points->size() == std::stoul(count));
      CHECK(read_points(*scan.points) == expected);
      REQUIRE(scan.header.notes.size() == 1);
      CHECK(scan.header.notes[0].find("further points behind") != std::string::npos);
    }
}

TEST_CASE("any part of an E57 scan is the same as within the whole") {
  const temporary_directory directory;
  points expected;
  const auto path = directory.file("a.e57", e57_file({mixed_scan(20'000, 501, expected)}));
  const opened_scan scan = open_e57_file(path, 1);
  for (const auto& [first, count] :
       {std::pair{0, 1}, {1, 1}, {7, 9}, {19'999, 1}, {8191, 2}, {3, 10'000}, {0, 0}}) {
    points part(static_cast<std::size_t>(count));
    scan.points->read(static_cast<std::size_t>(first), part);
    CHECK(std::equal(part.begin(), part.end(), expected.begin() + first));
  }
}

TEST_CASE("integers of an E57 scan may have any number of bits") {
  const temporary_directory directory;
  std::mt19937_64 random(3);
  for (unsigned bits = 0; bits <= 64; ++bits) {
    const std::int64_t minimum = bits == 64 ? std::numeric_limits<std::int64_t>::min() : -5;
    const std::uint64_t range = bits == 64 ? ~std::uint64_t(0) : (std::uint64_t(1) << bits) - 1;
    const auto maximum = static_cast<std::int64_t>(static_cast<std::uint64_t>(minimum) + range);
    if (maximum < minimum) continue;  // 63 bits from below 0 on are too many
    std::vector<std::int64_t> values(50);
    for (auto& value : values)
      value = static_cast<std::int64_t>(static_cast<std::uint64_t>(minimum) + (random() & range));
    const auto field = [&](const char* name) { return integer_field(name, minimum, maximum, values); };
    const auto path = directory.file(
        "a.e57", e57_file({{{field("cartesianX"), float_field("cartesianY", std::vector<float>(50)),
                             field("cartesianZ")}}}));
    const points read = read_e57(path);
    INFO(bits << " bits");
    REQUIRE(read.size() == values.size());
    for (std::size_t i = 0; i < values.size(); ++i)
      REQUIRE(read[i] == Eigen::Vector3d(static_cast<double>(values[i]), 0, static_cast<double>(values[i])));
  }
}

TEST_CASE("integers of an E57 scan have 64 bits where the prototype gives no bounds") {
  const temporary_directory directory;
  written_field x = integer_field("cartesianX", std::numeric_limits<std::int64_t>::min(),
                                  std::numeric_limits<std::int64_t>::max(), {-3, 4});
  x.declaration = "type=\"Integer\"";
  const auto path = directory.file(
      "a.e57", e57_file({{{x, double_field("cartesianY", {1, 2}), double_field("cartesianZ", {5, 6})}}}));
  CHECK(read_e57(path) == points{{-3, 1, 5}, {4, 2, 6}});
}

TEST_CASE("each scan of an E57 file has its points, its pose and its number") {
  const temporary_directory directory;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 2).normalized()));
  written_scan first{{float_field("cartesianX", {1, 2}), float_field("cartesianY", {3, 4}),
                      float_field("cartesianZ", {5, 6})}};
  written_scan second{
      {float_field("cartesianX", {7}), float_field("cartesianY", {8}), float_field("cartesianZ", {9})},
      e57_pose(turn, {100, -20, 3.25})};
  written_scan third = first;
  third.pose = e57_pose(Eigen::Quaterniond(2, 0, 0, 0), {1, 2, 3});  // no rotation
  written_scan empty{
      {float_field("cartesianX", {}), float_field("cartesianY", {}), float_field("cartesianZ", {})}};
  const auto path = directory.file("a.e57", e57_file({first, second, third, empty}));
  REQUIRE(count_scans_of(path) == 4);
  CHECK(read_points(*open_e57_file(path, 1).points) == points{{1, 3, 5}, {2, 4, 6}});
  const opened_scan scan = open_e57_file(path, 2);
  CHECK(read_points(*scan.points) == points{{7, 8, 9}});
  CHECK(scan.header.format == "E57 1.0, scan 2 of 4");
  REQUIRE(scan.header.pose);
  CHECK(scan.header.pose->isApprox(Eigen::Translation3d(100, -20, 3.25) * turn, 1e-12));
  CHECK_FALSE(open_e57_file(path, 3).header.pose);
  CHECK(open_e57_file(path, 4).points->size() == 0);
  for (const std::size_t number : {0u, 5u})
    require_error(
        path, [&](const auto& p) { open_e57_file(p, number); },
        "holds 4 scans, and no scan " + std::to_string(number), "counted from 1");
}

TEST_CASE("spherical coordinates of an E57 scan become Cartesian ones") {
  const temporary_directory directory;
  constexpr double pi = 3.14159265358979323846;
  const auto path = directory.file("a.e57", e57_file({{{double_field("sphericalElevation", {0, 0, pi / 2}),
                                                        double_field("sphericalRange", {2, 3, 4}),
                                                        double_field("sphericalAzimuth", {0, pi / 2, 1})}}}));
  const points read = read_e57(path);
  REQUIRE(read.size() == 3);
  CHECK((read[0] - Eigen::Vector3d(2, 0, 0)).norm() < 1e-15);
  CHECK((read[1] - Eigen::Vector3d(0, 3, 0)).norm() < 1e-15);
  CHECK((read[2] - Eigen::Vector3d(0, 0, 4)).norm() < 1e-15);
}

TEST_CASE("points of an E57 scan without valid coordinates are not-a-number") {
  const temporary_directory directory;
  const auto coordinates = [](const char* name) { return float_field(name, {1, 2, 3}); };
  written_scan scan{{coordinates("cartesianX"), coordinates("cartesianY"), coordinates("cartesianZ"),
                     integer_field("cartesianInvalidState", 0, 2, {0, 1, 2})}};
  points read = read_e57(directory.file("a.e57", e57_file({scan})));
  CHECK(read[0] == Eigen::Vector3d(1, 1, 1));
  CHECK((is_nan(read[1]) && is_nan(read[2])));

  scan.fields[3] = float_field("cartesianInvalidState", {0, 2, 0});  // as PDAL writes it
  read = read_e57(directory.file("b.e57", e57_file({scan})));
  CHECK((read[0].allFinite() && is_nan(read[1]) && read[2].allFinite()));

  scan.fields = {coordinates("sphericalRange"), coordinates("sphericalAzimuth"),
                 coordinates("sphericalElevation"), integer_field("sphericalInvalidState", 0, 1, {1, 0, 0})};
  read = read_e57(directory.file("c.e57", e57_file({scan})));
  CHECK((is_nan(read[0]) && read[1].allFinite() && read[2].allFinite()));
}

TEST_CASE("an E57 file that cannot be read is refused with what is wrong, and a remedy") {
  const temporary_directory directory;
  const auto require = [&](const std::string& bytes, const std::string& problem, const std::string& remedy) {
    require_error(directory.file("a.e57", bytes), read_e57, problem, remedy);
  };
  points expected;
  const std::string whole = e57_file({mixed_scan(3000, 500, expected)});
  std::string bytes = whole;
  bytes[5000] = static_cast<char>(bytes[5000] ^ 1);
  require(bytes, "damaged in its page 4 (bytes 4096 and on)", "Copy the file again");
  require(whole.substr(0, whole.size() - 1024), "ends before all the data", "again");
  require(e57_file({}), "holds no scan", "not only pictures");
  require(e57_file({{{float_field("intensity", {1, 2})}}}), "neither Cartesian nor spherical", "Export");
  bytes = whole;
  put_at<std::uint64_t>(bytes, 32, 0);
  seal_pages(bytes);
  require(bytes, "stopped before the end", "Export");
  put_at<std::uint32_t>(bytes, 8, 2);
  require(bytes, "is E57 2.0", "E57 1.0, PLY or LAS");
  const auto replaced = [&](const std::string& from, const std::string& to) {
    bytes = whole;
    bytes.replace(bytes.find(from), from.size(), to);
    seal_pages(bytes);
    return bytes;
  };
  require(replaced("recordCount=\"3000\"", "recordCount=\"3001\""), "holds fewer points than the 3001",
          "again");
  require(replaced("recordCount=\"3000\"", "recordCount=\"9e99\""), "without a valid 'recordCount'", "again");
  require(replaced("</prototype", "</prot0type"), "is no XML", "again");
}

TEST_CASE("an E57 scan of more points than the file has bytes is refused, however few bits they have") {
  const temporary_directory directory;
  const auto constant = [](const char* name) { return integer_field(name, 3, 3, {3, 3, 3}); };
  const auto path = directory.file(
      "a.e57", e57_file({{{constant("cartesianX"), constant("cartesianY"), constant("cartesianZ")}}}));
  CHECK(read_e57(path) == points(3, {3, 3, 3}));
  const std::string bytes = e57_file({{{integer_field("cartesianX", 3, 3, std::vector<std::int64_t>(5000, 3)),
                                        constant("cartesianY"), constant("cartesianZ")}}});
  require_error(directory.file("b.e57", bytes), read_e57, "more than it has bytes", "again");
}

}  // namespace globalmatch::support::test_e57_files

#include "support/scan_files.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <random>

#include <globalmatch/stem_mapping.hpp>

#include "catch.hpp"
#include "file_checks.hpp"
#include "forest_scenes.hpp"

namespace globalmatch::support::test_scan_files {

static_assert(point_range<scan_file> && std::ranges::random_access_range<const scan_file>);

TEST_CASE("what is no scan is refused with the formats that are") {
  const temporary_directory directory;
  std::string zeros(5000, '\0');
  require_error(directory.file("zeros.ply", zeros), read_scan, "in no format",
                "PLY, PCD, LAS, LAZ, E57, PTX or text");
  require_error(directory.file("prose.xyz", "Dear reader,\nthis is no scan.\n"), read_scan,
                "line 1 names no columns", "PLY, PCD, LAS, LAZ, E57 and PTX");
  require_error(directory.file("one_line.xyz", "Dear reader"), read_scan, "line 1 names no columns",
                "PLY, PCD, LAS, LAZ, E57 and PTX");
  require_error(directory.file("no_line_end.txt", std::string(3'000'000, 'x')), read_scan, "line 1 is longer",
                "unknown format");
}

TEST_CASE("meshes in text are refused by name, and not read as points") {
  const temporary_directory directory;
  for (const char* start : {"OFF\n4 2 0\n", "# c\nCOFF\n4 0 0\n", "STNOFF 4 2 0\n", "off\r\n4 2 0\r\n"})
    require_error(directory.file("a.txt", start + std::string("1 2 3\n4 5 6\n7 8 9\n1 1 1\n")), read_scan,
                  "is an OFF file", "PLY or text");
  for (const char* start : {"v 1 2 3\n", "mtllib a\n", "o\ta\n"})
    require_error(directory.file("a.xyz", start + std::string("v 4 5 6\n")), read_scan, "is an OBJ file",
                  "PLY or text");
}

TEST_CASE("a file that is one comment without a line end is refused") {
  const temporary_directory directory;
  for (const char* text : {"# c", "#", "# .PC", "#\n#", "\n", "\r"})
    CHECK_FALSE(error_of([&] { read_scan(directory.file("a.txt", text)); }).empty());
}

TEST_CASE("an empty, a missing and an irregular file are refused") {
  const temporary_directory directory;
  require_error(directory.file("empty.ply", ""), read_scan, "is empty", "again");
  require_error(directory.file("mark.txt", "\xEF\xBB\xBF"), read_scan, "is empty", "again");
  require_error(directory / "none.ply", read_scan, "does not exist", "Check");
  require_error(directory.path(), read_scan, "is a folder", "Name a file");
}

TEST_CASE("one scan of several is chosen by its number, and none without") {
  const temporary_directory directory;
  const std::string pose = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
  const auto path = directory.file("two.ptx", "1\n1\n" + pose + "1 2 3 0\n" + "1\n1\n" + pose + "4 5 6 0\n");
  const std::string name = path.string();
  CHECK(scans_in(path) == std::vector<std::filesystem::path>{name + "#1", name + "#2"});
  CHECK(read_scan(name + "#1") == points{{1, 2, 3}});
  CHECK(read_scan(name + "#2") == points{{4, 5, 6}});
  require_error(path, read_scan, "holds 2 scans", "\"" + name + "#1\" to \"" + name + "#2\"");
  CHECK_THAT(error_of([&] { read_scan(name + "#3"); }), Catch::Matchers::Contains("no scan 3"));
}

TEST_CASE("a file of one scan may be numbered 1, and one whose name has a number is itself") {
  const temporary_directory directory;
  const auto path = directory.file("a.txt", "1 2 3\n");
  CHECK(read_scan(path.string() + "#1") == points{{1, 2, 3}});
  CHECK_THAT(error_of([&] { read_scan(path.string() + "#2"); }), Catch::Matchers::Contains("no scan 2"));
  CHECK(scans_in(path) == std::vector{path});
  CHECK(read_scan(directory.file("b.txt#2", "4 5 6\n")) == points{{4, 5, 6}});
}

TEST_CASE("blocks of a PTS file are one scan, unless one of them is asked for") {
  const temporary_directory directory;
  CHECK(read_scan(directory.file("one.pts", "2\n1 2 3\n4 5 6\n")) == points{{1, 2, 3}, {4, 5, 6}});
  const auto two = directory.file("two.pts", "2\n1 2 3\n4 5 6\n1\n7 8 9\n");
  CHECK(read_scan(two.string() + "#2") == points{{7, 8, 9}});
  CHECK(read_scan(two) == points{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}});
  CHECK(scans_in(two) == std::vector{two});
}

TEST_CASE("a PTX file with comments, or with a damaged header, is not read as text") {
  const temporary_directory directory;
  const std::string axes = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n", matrix = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
  const std::string rows = "1 2 3 0\n4 5 6 0\n";
  CHECK(read_scan(directory.file("a.ptx", "\n# plot\n\n2\n1\n" + axes + matrix + rows)).size() == 2);
  const auto cut = directory.file("b.ptx", "2\n1\n" + axes + "1 0 0 0\n0 1 0\n0 0 1 0\n0 0 0 1\n" + rows);
  require_error(cut, read_scan, "PTX header", "Export");
  const auto axis = directory.file("c.ptx", "2\n1\n0 0 0\n1 0\n0 1 0\n0 0 1\n" + matrix + rows);
  require_error(axis, read_scan, "damaged PTX header", "Export");
}

TEST_CASE("binary data behind a header in UTF-16 are refused") {
  const temporary_directory directory;
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\n"
      "property float y\nproperty float z\nend_header\n";
  std::string bytes = "\xFF\xFE";
  for (const char c : header) bytes += {c, '\0'};
  require_error(directory.file("a.ply", bytes + std::string(12, '\1')), read_scan, "UTF-16", "Export");
}

TEST_CASE("any bytes behind any signature are read or refused, and never crash") {
  const temporary_directory directory;
  std::mt19937 random(7);
  const std::vector<std::string> starts = {
      "",
      "ply\n",
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property list uchar int i\nproperty float z\nend_header\n",
      "LASF",
      "# .PCD v0.7\n",
      "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 9\nDATA binary_compressed\n",
      "VERSION 0.7\n",
      "x,y,z\n",
      "3\n"};
  int answers = 0;
  for (int trial = 0; trial < 400; ++trial) {
    std::string bytes = starts[static_cast<std::size_t>(trial) % starts.size()];
    const std::size_t size = random() % 700;
    for (std::size_t i = 0; i < size; ++i) bytes.push_back(static_cast<char>(random() % 256));
    const auto path = directory.file("scan", bytes);
    const std::string error = error_of([&] { answers += read_scan(path).size() < bytes.size(); });
    answers += !error.empty();
  }
  CHECK(answers == 400);
}

TEST_CASE("each prefix of a PLY that lacks a vertex is refused") {
  const temporary_directory directory;
  write_ply(directory / "whole.ply", points{{1, 2, 3}, {4, 5, 6}});
  const std::string whole = bytes_of(directory / "whole.ply");
  for (std::size_t size = 4; size < whole.size(); ++size) {
    const auto path = directory.file("part.ply", whole.substr(0, size));
    const std::string error = error_of([&] { read_scan(path); });
    CHECK(error.find("part.ply") != std::string::npos);
  }
}

TEST_CASE("a written PLY yields the same points, as float where that keeps a tenth of a millimetre") {
  const temporary_directory directory;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> within(-1, 1);
  const auto [extent, tolerance, type] = GENERATE(
      table<double, double, std::string>({{1000, 5e-5, "property float x"}, {5e6, 0, "property double x"}}));
  points written(30'000);
  for (Eigen::Vector3d& p : written)
    p = extent * Eigen::Vector3d(within(random), within(random), within(random));
  write_ply(directory / "a.ply", written);

  CHECK(bytes_of(directory / "a.ply").find(type) != std::string::npos);
  const points read = read_scan(directory / "a.ply");
  REQUIRE(read.size() == written.size());
  double largest = 0;
  for (std::size_t i = 0; i < read.size(); ++i)
    largest = std::max(largest, (read[i] - written[i]).cwiseAbs().maxCoeff());
  CHECK(largest <= tolerance);
}

TEST_CASE("a written PLY may hold colours and no points") {
  const temporary_directory directory;
  const points two = {{1, 2, 3}, {4, 5, 6}};
  const std::vector<rgb> colours = {{1, 2, 255}, {4, 5, 6}};
  write_ply(directory / "two.ply", two, colours);
  CHECK(read_scan(directory / "two.ply") == two);
  CHECK(bytes_of(directory / "two.ply").substr(bytes_of(directory / "two.ply").size() - 3) == "\x04\x05\x06");

  write_ply(directory / "none.ply", {});
  CHECK(read_scan(directory / "none.ply").empty());
}

TEST_CASE("colours that are not one for each point are an invalid argument, and no file is left") {
  const temporary_directory directory;
  const points two = {{1, 2, 3}, {4, 5, 6}};
  CHECK_THROWS_AS(write_ply(directory / "a.ply", two, std::vector<rgb>(3)), std::invalid_argument);
  CHECK(directory.count_files() == 0);
}

TEST_CASE("an open scan is passed forwards, backwards and in jumps, and copies of a place are of their own") {
  const temporary_directory directory;
  points written;
  for (int i = 0; i < 5000; ++i) written.emplace_back(i, 2 * i, -i);
  write_ply(directory / "a.ply", written);
  const scan_file scan = open_scan(directory / "a.ply");
  REQUIRE(scan.size() == written.size());

  CHECK(points(scan.begin(), scan.end()) == written);
  CHECK(points(std::reverse_iterator(scan.end()), std::reverse_iterator(scan.begin())) ==
        points(written.rbegin(), written.rend()));
  auto place = scan.begin();
  for (const std::ptrdiff_t jump : {4999, -4000, 17, -1016, 3000}) {
    const auto before = place;
    const Eigen::Vector3d p = *before;
    place += jump;
    CHECK(*place == written[std::size_t(place - scan.begin())]);
    CHECK(before[jump] == *place);
    CHECK(*before == p);
  }
}

TEST_CASE("stems of a scan in a file are those of its points in memory, with any number of threads") {
  const temporary_directory directory;
  const scenes::cloud cloud = scenes::small_plot().scan();
  points scan;
  for (const Eigen::Vector3f& p : cloud) scan.push_back(p.cast<double>());
  write_ply(directory / "a.ply", scan);
  const scan_file file = open_scan(directory / "a.ply");
  const stem_map expected = map_stems(read_scan(directory / "a.ply"));
  REQUIRE(!expected.stems.empty());
  for (const int threads : {1, 4}) {
    const stem_map map = map_stems(file, {}, {0, 0, 1}, {.threads = threads});
    REQUIRE(map.stems.size() == expected.stems.size());
    for (std::size_t i = 0; i < map.stems.size(); ++i)
      CHECK(map.stems[i].position == expected.stems[i].position);
  }
}

TEST_CASE("a scan that is cut off while it is mapped is an error") {
  const temporary_directory directory;
  write_ply(directory / "a.ply", points(100'000, Eigen::Vector3d(1, 2, 3)));
  const scan_file scan = open_scan(directory / "a.ply");
  std::filesystem::resize_file(directory / "a.ply", 500'000);
  require_error(
      directory / "a.ply", [&](const auto&) { map_stems(scan); }, "ends before", "again");
}

TEST_CASE("the real scans hold the points that their headers announce") {
  const std::filesystem::path clouds = std::filesystem::path(GLOBALMATCH_SHARED_DATA) / "clouds";
  if (!std::filesystem::is_directory(clouds)) {
    WARN("skipped: the folder of real scans does not exist: " << clouds);
    return;
  }
  const points pines = read_scan(clouds / "pine_plot_interleaved_src.ply");
  CHECK(pines.size() == 57012);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : pines) box.extend(p);
  CHECK(box.sizes().head<2>().maxCoeff() < 20);  // a plot of 10 m x 10 m, turned
}

}  // namespace globalmatch::support::test_scan_files

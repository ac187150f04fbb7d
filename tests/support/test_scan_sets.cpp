#include "support/scan_sets.hpp"

#include <cmath>
#include <filesystem>
#include <functional>

#include "catch.hpp"
#include "file_checks.hpp"

namespace globalmatch::support::test_scan_sets {

namespace {

points along_x(int count, double y) {
  points result;
  for (int i = 0; i < count; ++i) result.emplace_back(i, y, 0);
  return result;
}

}  // namespace

TEST_CASE("a folder stands for the scans in it, by name, and a file of several for each of them") {
  const temporary_directory directory;
  const auto folder = directory / "scans";
  std::filesystem::create_directory(folder);
  write_ply(folder / "b.PLY", points{{1, 2, 3}});
  write_ply(folder / "a.ply", points{{1, 2, 3}});
  write_ply(folder / "pose.txt", points{{1, 2, 3}});
  const std::string pose = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
  const std::string scan = "1\n1\n" + pose + "1 2 3 0\n";
  const auto two = directory.file("two.ptx", scan + scan);
  const std::string name = two.string();
  CHECK(holds_scans(folder));
  CHECK(find_scans({two, folder}) ==
        std::vector<std::filesystem::path>{name + "#1", name + "#2", folder / "a.ply", folder / "b.PLY"});
  CHECK(name_of(name + "#2") == "two_2");
  CHECK(name_of(folder / "b.PLY") == "b");
}

TEST_CASE("a folder without scans is refused, and one without --tiles is no scan") {
  const temporary_directory directory;
  const auto find = [](const std::filesystem::path& path) { find_scans({path}); };
  require_error(directory.path(), find, "holds no scans", ".laz");
  CHECK_FALSE(holds_scans(directory.path()));
  require_error(directory.path(), read_scan, "is a folder", "--tiles");
  const auto open = [](const std::filesystem::path& path) { open_scan(path, {.tiles = true}); };
  require_error(directory.path(), open, "holds no scans", ".laz");
}

TEST_CASE("makers' formats in a folder are refused with their export, or said to be passed over") {
  const auto find = [](const std::filesystem::path& path) { find_scans({path}); };
  const auto open_tiles_in = [](const std::filesystem::path& path) {
    return open_scan(path, {.tiles = true});
  };
  for (const std::string name : {"a.fls", "b.RXP", "c.zfs"}) {
    const temporary_directory directory;
    const auto file = directory.file(name, std::string("\1\0\2", 3));
    for (const auto& read : {std::function<void(std::filesystem::path)>(find),
                             std::function<void(std::filesystem::path)>(open_tiles_in)})
      CHECK_THAT(error_of([&] { read(directory.path()); }),
                 Catch::Contains(file.string()) && Catch::Contains("Export each"));
    write_ply(directory / "a.ply", points{{1, 2, 3}});
    CHECK(find_scans({directory.path()}) == std::vector<std::filesystem::path>{directory / "a.ply"});
    const scan_file tiles = open_tiles_in(directory.path());
    REQUIRE(tiles.header().notes.size() == 1);
    CHECK_THAT(tiles.header().notes[0], Catch::Contains("1 files of makers are passed over: " + name));
  }
  for (const std::string name : {"scan.fls", "p.RiSCAN"}) {
    const temporary_directory directory;
    std::filesystem::create_directory(directory / name);
    const auto folder = directory / name / "";
    require_error(directory / name, find, "which this program does not read", "Export each");
    require_error(folder, find, "which this program does not read", "Export each");
    require_error(folder, read_scan, "which this program does not read", "Export each");
    CHECK_THAT(error_of([&] { find(directory.path()); }), Catch::Contains(name));
  }
}

TEST_CASE("a pattern is not taken where one file is, and the message says so") {
  const temporary_directory directory;
  require_error(directory / "*.las", read_scan, "does not exist", "Patterns are not taken here");
  require_error(directory / "a.las", read_scan, "does not exist", "Check the spelling");
}

TEST_CASE("scans with poses of their own are no tiles") {
  const temporary_directory directory;
  const auto ptx = [](double x) {
    return "1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n" + std::to_string(x) +
           " 0 0 1\n1 2 3 0\n";
  };
  directory.file("a.ptx", ptx(0));
  const auto b = directory.file("b.ptx", ptx(500));
  const auto open = [](const std::filesystem::path& path) { return open_scan(path, {.tiles = true}); };
  require_error(directory.path(), open, "poses of their own", "--tiles");
  std::filesystem::remove(b);
  directory.file("b.ptx", ptx(0));
  CHECK(open(directory.path()).size() > 0);
}

TEST_CASE("a scan is known under several names, and results are named by all of it") {
  const temporary_directory directory;
  write_ply(directory / "a.b.ply", points{{1, 2, 3}});
  write_ply(directory / "._a.b.ply", points{{1, 2, 3}});
  CHECK(find_scans({directory.path()}) == std::vector{directory / "a.b.ply"});
  CHECK(name_of(directory / "a.b.ply") == "a.b");
  CHECK(name_of((directory / "a.b.ply").string() + "#2") == "a.b_2");
  CHECK(name_of(directory.path() / "") == directory.path().filename());
}

TEST_CASE("a pattern stands for the files that it matches, by name, and one that matches none is refused") {
  const temporary_directory directory;
  for (const char* name : {"scan_2.ply", "scan_1.ply", "scan_10.ply", ".scan_3.ply", "other.ply"})
    write_ply(directory / name, points{{1, 2, 3}});
  const auto found = [&](std::string_view pattern) { return find_scans({directory / pattern}); };
  CHECK(found("scan_?.ply") == std::vector{directory / "scan_1.ply", directory / "scan_2.ply"});
  CHECK(found("s*1*.ply") == std::vector{directory / "scan_1.ply", directory / "scan_10.ply"});
  CHECK(found("scan_?.ply#1").front() == directory / "scan_1.ply#1");
  CHECK(found("../" + directory.path().filename().string() + "/o*").size() == 1);
  const auto find = [](const std::filesystem::path& path) { find_scans({path}); };
  require_error(directory / "*.las", find, "matches no file", "Check");
  require_error(directory / "no*/a.ply", find, "matches no file", "Check");
#if !defined(_WIN32)  // where no name holds a star
  write_ply(directory / "a*.ply", points{{1, 2, 3}});
  write_ply(directory / "ab.ply", points{{1, 2, 3}});
  CHECK(found("a*.ply") == std::vector{directory / "a*.ply"});
#endif
}

TEST_CASE("tiles of one scan are passed one after the other") {
  const temporary_directory directory;
  points expected;
  for (const int count : {5000, 1, 4096, 0, 3}) {
    const points tile = along_x(count, double(expected.size()));
    write_ply(
        directory / ("tile_" + std::to_string(expected.size() + 10000) + std::to_string(count) + ".ply"),
        tile);
    expected.insert(expected.end(), tile.begin(), tile.end());
  }
  points read;
  for (const Eigen::Vector3d& p : open_scan(directory.path(), {.tiles = true}))
    if (p.allFinite()) read.push_back(p);
  CHECK(read == expected);
}

}  // namespace globalmatch::support::test_scan_sets

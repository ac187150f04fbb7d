#include "catch.hpp"
#include "file_checks.hpp"
#include "support/pts.hpp"

namespace globalmatch::support::test_pts_files {

namespace {

opened_scan open_pts_file(const std::filesystem::path& path, std::size_t number) {
  input_file file(path);
  return open_pts(file, number, {});
}

points read_block(const std::filesystem::path& path, std::size_t number) {
  const opened_scan scan = open_pts_file(path, number);
  points all(scan.points->size());
  scan.points->read(0, all);
  return all;
}

const std::string blocks = "2\n1.5 -2 3 -100 9 9 9\n4 5.25 -6 -100 9 9 9\n0\n1\n7 8 9 0 1 1 1\n";

}  // namespace

TEST_CASE("a PTS file begins with a count, and a point or another count") {
  CHECK(looks_like_pts("2\n1 2 3\n4 5 6\n"));
  CHECK(looks_like_pts("  2 \r\n1 2 3 -100 9 9 9\r\n"));
  CHECK(looks_like_pts("# from Cyclone\n\n2\n1,2,3\n"));
  CHECK(looks_like_pts("0\n3\n1 2 3\n"));
  CHECK_FALSE(looks_like_pts("0\n"));
  CHECK_FALSE(looks_like_pts("1 2 3\n4 5 6\n"));
  CHECK_FALSE(looks_like_pts("2\n1 2\n"));
  CHECK_FALSE(looks_like_pts("x y z\n1 2 3\n"));
}

TEST_CASE("each block of a PTS file is a scan") {
  const temporary_directory directory;
  const auto path = directory.file("a.pts", blocks);
  CHECK(read_scan(path).size() == 3);
  CHECK(read_block(path, 1) == points{{1.5, -2, 3}, {4, 5.25, -6}});
  CHECK(read_block(path, 2).empty());
  CHECK(read_block(path, 3) == points{{7, 8, 9}});
  const opened_scan scan = open_pts_file(path, 3);
  CHECK(scan.header.format == "PTS, scan 3 of 3");
  CHECK(scan.header.attributes == std::vector<std::string>{"intensity", "red", "green", "blue"});
  CHECK_FALSE(scan.header.pose);
  for (const std::size_t number : {0u, 4u})
    require_error(
        path, [&](const auto& p) { open_pts_file(p, number); },
        "holds 3 blocks of points, and no block " + std::to_string(number), "counted from 1");
}

TEST_CASE("blocks of a PTS file may have comments, blank lines, CRLF and other separators") {
  const temporary_directory directory;
  const auto path =
      directory.file("a.pts", "# plot 7\r\n1\r\n1.5;-2;3\r\n\r\n// next\r\n2\r\n1,2,3\r\n\r\n4,5,6\r\n");
  CHECK(read_block(path, 1) == points{{1.5, -2, 3}});
  CHECK(read_block(path, 2) == points{{1, 2, 3}, {4, 5, 6}});
}

TEST_CASE("a block of a PTS file with other points than it announces is refused") {
  const temporary_directory directory;
  const auto require = [&](const std::string& bytes, std::size_t number, const std::string& problem) {
    const auto path = directory.file("a.pts", bytes);
    require_error(
        path, [&](const auto& p) { read_block(p, number); }, problem, " ");
  };
  require("1\n1 2 3\n3\n1 2 3\n", 2, "block 2 that announces 3 points but holds 1");
  require("1\n1 2 3\n4 5 6\n1\n1 2 3\n", 1, "block 1 that announces 1 points but holds 2");
  require("1\n1 2 3\n1\n1 2\n", 2, "line 4 has only 2 fields");
  require("1\n1 2 3\n1\n1 2 x\n", 2, "line 4 has 'x'");
  require("18446744073709551615\n1 2 3\n1\n1 2 3\n", 1, "but holds 1");
  require("1 2 3\n1\n1 2 3\n", 1, "line 1 is no count of points");
  const auto all = directory.file("all.pts", "3\n1 2 3\n4 5 6\n1\n7 8 9\n1 1 1\n");
  require_error(all, read_scan, "block 1 that announces 3 points but holds 2", "again");
}

TEST_CASE("a PTS file with any byte changed, or cut anywhere, is refused or read") {
  const temporary_directory directory;
  const auto is_answered = [&](const std::string& bytes) {
    const auto path = directory.file("a.pts", bytes);
    std::size_t read = 0;
    const std::string error = error_of([&] {
      read_scan(path);
      for (std::size_t number = 1; number <= 3; ++number) read += read_block(path, number).size();
    });
    return !error.empty() || read <= bytes.size();
  };
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    std::string bytes = blocks;
    for (const char c : {'9', '\n', ' ', '-', '\0', '\xFF'}) {
      bytes[i] = c;
      CHECK(is_answered(bytes));
    }
    CHECK(is_answered(blocks.substr(0, i)));
  }
}

}  // namespace globalmatch::support::test_pts_files

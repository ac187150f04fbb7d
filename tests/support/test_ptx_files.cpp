#include <random>

#include "catch.hpp"
#include "file_checks.hpp"
#include "support/ptx.hpp"

namespace globalmatch::support::test_ptx_files {

namespace {

const std::string identity = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
const std::string first_scan = "2\n2\n" + identity + "1.5 -2 3 0.5\n0 0 0 0.5\n0 0 0 0.5\n4 5.25 -6 0.5\n";
// A quarter turn about z, then the translation: x to y, y to -x.
const std::string second_scan =
    "1\n3\n10 20 30\n0 1 0\n-1 0 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n10 20 30 1\n"
    "7 8 9 0.1 10 20 30\n1 2 3 0.2 10 20 30\n0 0 0 0 0 0 0\n";

std::size_t count_scans_of(const std::filesystem::path& path) {
  input_file file(path);
  return count_ptx_scans(file);
}

opened_scan open_ptx_file(const std::filesystem::path& path, std::size_t number) {
  input_file file(path);
  return open_ptx(file, number, {});
}

points read_points(const point_source& source) {
  points all(source.size());
  source.read(0, all);
  return all;
}

points read_first(const std::filesystem::path& path) {
  return read_points(*open_ptx_file(path, 1).points);
}

}  // namespace

TEST_CASE("the header of a PTX file tells it from other text") {
  CHECK(looks_like_ptx(first_scan));
  CHECK(looks_like_ptx(second_scan.substr(0, second_scan.find("7 8 9"))));
  CHECK_FALSE(looks_like_ptx("2\n1 2 3\n4 5 6\n"));
  CHECK_FALSE(looks_like_ptx(first_scan.substr(0, 10)));
  CHECK_FALSE(looks_like_ptx("2.5" + first_scan.substr(1)));
}

TEST_CASE("each scan of a PTX file is read without its empty returns") {
  const temporary_directory directory;
  const auto path = directory.file("a.ptx", first_scan + second_scan + "\n" + first_scan);
  REQUIRE(count_scans_of(path) == 3);
  const points of_first = {{1.5, -2, 3}, {4, 5.25, -6}};
  const opened_scan first = open_ptx_file(path, 1), second = open_ptx_file(path, 2);
  CHECK(read_points(*first.points) == of_first);
  CHECK(first.header.format == "PTX, scan 1 of 3");
  CHECK(first.header.attributes == std::vector<std::string>{"intensity"});
  CHECK(read_points(*second.points) == points{{7, 8, 9}, {1, 2, 3}});
  CHECK(second.header.attributes == std::vector<std::string>{"intensity", "red", "green", "blue"});
  CHECK(read_points(*open_ptx_file(path, 3).points) == of_first);
  for (const std::size_t number : {0u, 4u})
    require_error(
        path, [&](const auto& p) { open_ptx_file(p, number); },
        "holds 3 scans, and no scan " + std::to_string(number), "counted from 1");
  CHECK(open_ptx_file(directory.file("b.ptx", first_scan), 1).header.format == "PTX");
}

TEST_CASE("the pose of a PTX scan takes its points to the survey: its matrix is written transposed") {
  const temporary_directory directory;
  const opened_scan scan = open_ptx_file(directory.file("a.ptx", second_scan), 1);
  REQUIRE(scan.header.pose);
  CHECK(scan.header.notes.empty());
  CHECK((*scan.header.pose * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(10, 21, 30)));
  CHECK((*scan.header.pose * Eigen::Vector3d(0, 2, 1)).isApprox(Eigen::Vector3d(8, 20, 31)));
}

TEST_CASE("a PTX matrix that is not rigid is no pose") {
  const temporary_directory directory;
  for (const std::string row : {"0 0 2 0", "0 0 -1 0", "0 0 0 0", "0 0 1 5", "0 0 nan 0", "0.5 0 1 0"}) {
    std::string bytes = first_scan;
    bytes.replace(bytes.find("0 0 1 0"), 7, row);
    const opened_scan scan = open_ptx_file(directory.file("a.ptx", bytes), 1);
    INFO(row);
    CHECK_FALSE(scan.header.pose);
    REQUIRE(scan.header.notes.size() == 1);
    CHECK(scan.header.notes[0].find("no rotation and translation") != std::string::npos);
    CHECK(scan.points->size() == 2);
  }
}

TEST_CASE("a PTX file with other points than it announces is refused") {
  const temporary_directory directory;
  const auto require = [&](const std::string& bytes, const std::string& problem, const std::string& remedy) {
    const auto path = directory.file("a.ptx", bytes);
    require_error(path, read_first, problem, remedy);
  };
  require(first_scan + "1 2 3 0.5\n", "line 15 has other than the numbers (1)", "Export");
  require(first_scan + second_scan.substr(0, 13), "ends before", "again");
  require(first_scan.substr(0, first_scan.size() - 14), "ends before", "again");
  require("99999999\n99999999" + first_scan.substr(3), "ends before", "again");
  require("18446744073709551615\n18446744073709551615" + first_scan.substr(3), "ends before", "again");
  require("2\n2\n" + identity + "1 2 3 4\n1 2\n1 2 3 4\n1 2 3 4\n", "line 12 has only 2 fields", "Mend");
}

TEST_CASE("a PTX file with any byte changed, or cut anywhere, is refused or read") {
  const temporary_directory directory;
  const std::string whole = first_scan + second_scan;
  const auto is_answered = [&](const std::string& bytes) {
    const auto path = directory.file("a.ptx", bytes);
    std::size_t read = 0;
    const std::string error = error_of([&] {
      for (std::size_t number = 1, count = count_scans_of(path); number <= count; ++number)
        read += read_points(*open_ptx_file(path, number).points).size();
    });
    return !error.empty() || read <= bytes.size();
  };
  std::mt19937 random(2);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string bytes = whole;
    for (const char c : {'9', '\n', ' ', '-', static_cast<char>(random() % 256)}) {
      bytes[i] = c;
      CHECK(is_answered(bytes));
    }
    CHECK(is_answered(whole.substr(0, i)));
  }
}

}  // namespace globalmatch::support::test_ptx_files

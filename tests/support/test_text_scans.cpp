#include "catch.hpp"
#include "file_checks.hpp"
#include "support/scan_files.hpp"

namespace globalmatch::support::test_text_scans {

namespace {

const points two_points = {{1.5, -2, 3}, {4, 5.25, -6}};

void require_two_points(const std::string& text) {
  const temporary_directory directory;
  INFO(text);
  CHECK(read_scan(directory.file("scan", text)) == two_points);
}

}  // namespace

TEST_CASE("a text scan may be separated by blanks, tabs, commas or semicolons") {
  require_two_points("1.5 -2 3\n4 5.25 -6\n");
  require_two_points("1.5\t-2\t3\n4\t5.25\t-6");
  require_two_points("  1.5   -2 \t 3  \n  4 5.25 -6 \n");
  require_two_points("1.5,-2,3\n4,5.25,-6\n");
  require_two_points("1.5, -2, 3\n4, 5.25, -6\n");
  require_two_points("1.5;-2;3\n4;5.25;-6\n");
}

TEST_CASE("a text scan may have CRLF, a byte order mark, comments, blank lines and further columns") {
  require_two_points("1.5 -2 3\r\n4 5.25 -6\r\n");
  require_two_points(
      "\xEF\xBB\xBF"
      "1.5 -2 3\n4 5.25 -6\n");
  require_two_points("# made by hand\n\n1.5 -2 3\n// between\n4 5.25 -6\n\n# end");
  require_two_points("1.5 -2 3 17 a word\n4 5.25 -6 18 another\n");
  require_two_points("+1.5 -2e0 3.\n4 5.25 -6\n");
}

TEST_CASE("a header of a text scan names the columns, in any order, case and quotes") {
  require_two_points("x,y,z\n1.5,-2,3\n4,5.25,-6\n");
  require_two_points("id,Z,X,Y\n7,3,1.5,-2\n8,-6,4,5.25\n");
  require_two_points("\"\",\"x\",\"y\",\"z\"\n\"1\",1.5,-2,3\n\"2\",4,5.25,-6\n");
  require_two_points("intensity x y z\n9 1.5 -2 3\n9 4 5.25 -6\n");
  require_two_points("name,x,y,z\n\"a, b\",1.5,-2,3\n,4,5.25,-6\n");
}

TEST_CASE("without a header the first three columns count") {
  require_two_points("1.5 -2 3 9\n4 5.25 -6 9\n");
  require_two_points("Plot\n1.5 -2 3 9\n4 5.25 -6 9\n");
  require_two_points("\"a\" 1.5 -2 3 9\n\"b\" 4 5.25 -6 9\n");
}

TEST_CASE("a comment is a header if it has a name for each column") {
  require_two_points("//X Y Z Intensity\n1.5 -2 3 9\n4 5.25 -6 9\n");
  require_two_points("# id x y z\n1 1.5 -2 3\n2 4 5.25 -6\n");
  require_two_points("# the columns are x y z\n1.5 -2 3\n4 5.25 -6\n");
}

TEST_CASE("a leading point count, as in PTS files, is no point") {
  require_two_points("2\n1.5 -2 3 -100 9 9 9\n4 5.25 -6 -100 9 9 9\n");
}

TEST_CASE("a text scan larger than any block is read to its last point") {
  const temporary_directory directory;
  const int count = 200'000;
  std::string text;
  for (int i = 0; i < count; ++i) text += std::to_string(i) + " " + std::to_string(i) + ".25 1\n";
  const points read = read_scan(directory.file("a.xyz", text));
  REQUIRE(read.size() == static_cast<std::size_t>(count));
  bool all_equal = true;
  for (int i = 0; i < count; ++i)
    all_equal = all_equal && read[static_cast<std::size_t>(i)] == Eigen::Vector3d(i, i + 0.25, 1);
  CHECK(all_equal);
}

TEST_CASE("a table without rows, and a count of 0, are empty scans") {
  const temporary_directory directory;
  CHECK(read_scan(directory.file("a.csv", "x,y,z\n")).empty());
  CHECK(read_scan(directory.file("a.pts", "0\n")).empty());
}

TEST_CASE("a line of a text scan that is no point is refused with its number") {
  const temporary_directory directory;
  const auto require = [&](const std::string& text, const std::string& problem, const std::string& remedy) {
    require_error(directory.file("a.txt", text), read_scan, problem, remedy);
  };
  require("1 2 3\n4 5\n", "line 2 has only 2 fields", "Mend");
  require("1 2\n", "line 1 has only 2 fields", "Mend");
  require("1,2,3\n4,,6\n", "line 2 has ''", "like 12.5");
  require("1 2 3\n4 five 6\n", "line 2 has 'five'", "like 12.5");
  require("1 2 3\n\n4 5 1e999\n", "line 3 has '1e999'", "like 12.5");
}

TEST_CASE("a header that does not fit its text scan is refused") {
  const temporary_directory directory;
  const auto require = [&](const std::string& text, const std::string& problem) {
    require_error(directory.file("a.txt", text), read_scan, problem, "named by a header");
  };
  require("x,y\n1,2\n", "line 1 names no columns that are known to be x and y and z: 'x,y'");
  require("id,time,range\n1,2,3\n", "known to be x and y and z: 'id,time,range'");
  require("id,x,y,z\n1 4 5 6 7\n", "4 names above lines of 5 fields");
}

TEST_CASE("coordinates that may be two columns, or are angles, are refused") {
  const temporary_directory directory;
  require_error(directory.file("a.csv", "id,x,X,y,z\n1,2,2,3,4\n"), read_scan,
                "two columns that may be that of 'x': 'id,x,X,y,z'", "Name one column");
  require_error(directory.file("b.csv", "longitude,latitude,altitude\n1,2,3\n"), read_scan,
                "has angles in column", "in metres");
}

TEST_CASE("a text scan with fewer points than it announces is refused") {
  const temporary_directory directory;
  require_error(directory.file("a.pts", "3\n1 2 3\n4 5 6\n"), read_scan, "announces 3 points but holds 2",
                "truncated");
  require_error(directory.file("b.pts", "1000000000000000000\n1 2 3\n"), read_scan, "announces", "truncated");
}

}  // namespace globalmatch::support::test_text_scans

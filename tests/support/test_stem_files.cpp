#include "support/stem_files.hpp"

#include <cmath>
#include <limits>
#include <random>

#include "catch.hpp"
#include "file_checks.hpp"

namespace globalmatch::support::test_stem_files {

namespace {

const double unknown = std::numeric_limits<double>::quiet_NaN();

stem_table read_text(const std::string& text) {
  const temporary_directory directory;
  return read_stems(directory.file("stems.csv", text));
}

void require_stem(const stem_record& stem, double x, double y, double z) {
  CHECK(stem.x == x);
  CHECK(stem.y == y);
  CHECK(stem.z == z);
}

}  // namespace

TEST_CASE("written stems are read as the same bits") {
  const temporary_directory directory;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> anywhere(-1e6, 1e6);
  std::vector<stem_record> written(100);
  for (stem_record& s : written)
    s = {anywhere(random), anywhere(random), anywhere(random), anywhere(random) / 1e7 + 0.2};
  written[5].radius = unknown;
  write_stems(directory / "a.csv", written);

  const stem_table read = read_stems(directory / "a.csv");
  CHECK(read.has_heights);
  CHECK(read.has_radii);
  REQUIRE(read.stems.size() == written.size());
  for (std::size_t i = 0; i < written.size(); ++i) {
    require_stem(read.stems[i], written[i].x, written[i].y, written[i].z);
    CHECK((i == 5 ? std::isnan(read.stems[i].radius) : read.stems[i].radius == written[i].radius));
  }
}

TEST_CASE("further columns are written behind the radius, NaN as an empty field") {
  const temporary_directory directory;
  const std::vector<stem_record> stems = {{1, 2, 3, 0.5}, {4, 5, 6, unknown}};
  write_stems(directory / "a.csv", stems,
              std::vector<stem_column>{{"points", {17, 18}}, {"lean", {0.25, unknown}}});
  CHECK(bytes_of(directory / "a.csv") == "x,y,z,radius,points,lean\n1,2,3,0.5,17,0.25\n4,5,6,,18,\n");
  CHECK(read_stems(directory / "a.csv").stems.size() == 2);
}

TEST_CASE("a further column that has not one value for each stem is an invalid argument") {
  const temporary_directory directory;
  CHECK_THROWS_AS(write_stems(directory / "a.csv", {}, std::vector<stem_column>{{"points", {17}}}),
                  std::invalid_argument);
  CHECK(directory.count_files() == 0);
}

TEST_CASE("no stems are written as a header line and read as an empty map") {
  const temporary_directory directory;
  write_stems(directory / "a.csv", {});
  CHECK(bytes_of(directory / "a.csv") == "x,y,z,radius\n");
  CHECK(read_stems(directory / "a.csv").stems.empty());
}

TEST_CASE("columns are found by name in any order and case, and others ignored even as text") {
  const stem_table table =
      read_text("species,Y,\"X\",Radius,note\n\"Pinus, sylvestris\",2,1,0.25,n/a\nBirch,4,3,0.5,\n");
  REQUIRE(table.stems.size() == 2);
  CHECK_FALSE(table.has_heights);
  require_stem(table.stems[0], 1, 2, 0);
  require_stem(table.stems[1], 3, 4, 0);
  CHECK(table.stems[0].radius == 0.25);
}

TEST_CASE("dbh is halved, and a radius beside it wins") {
  CHECK(read_text("x,y,dbh\n1,2,0.5\n").stems[0].radius == 0.25);
  CHECK(read_text("x,y,dbh,radius\n1,2,0.5,0.125\n").stems[0].radius == 0.125);
  const stem_table without = read_text("x,y,z\n1,2,3\n");
  CHECK_FALSE(without.has_radii);
  CHECK(std::isnan(without.stems[0].radius));
}

TEST_CASE("a radius that is missing is not known") {
  const stem_table table = read_text("x,y,radius\n1,2,\n1,2,NA\n1,2,nan\n");
  REQUIRE(table.stems.size() == 3);
  for (const stem_record& stem : table.stems) CHECK(std::isnan(stem.radius));
}

TEST_CASE("stem files may have CRLF, a byte order mark, blank lines, and other separators") {
  for (const char* text :
       {"\xEF\xBB\xBFx,y,z\r\n1,2,3\r\n", "x,y,z\n\n1,2,3\n\n", "x;y;z\n1;2;3\n", "x\ty\tz\n1\t2\t3",
        "x, y, z\n1, 2, 3\n", "\"x\",\"y\",\"z\"\n\"1\",\"2\",\"3\"\n"}) {
    const stem_table table = read_text(text);
    REQUIRE(table.stems.size() == 1);
    require_stem(table.stems[0], 1, 2, 3);
    CHECK(table.has_heights);
  }
}

TEST_CASE("a stem whose position is no number is refused with line and column") {
  const temporary_directory directory;
  const auto require = [&](const std::string& rows, const std::string& problem) {
    require_error(directory.file("stems.csv", "x,y,z,radius\n0,0,0,0\n" + rows), read_stems, problem,
                  "Write a number");
  };
  require("1,inf,3,0.1\n", "line 3 has 'inf' in column y");
  require("1m,2,3,0.1\n", "line 3 has '1m' in column x");
  require("\n1,2,high,0.1\n", "line 4 has 'high' in column z");
}

TEST_CASE("rows without a position are left out, and said to be") {
  const stem_table table =
      read_text("x,y,z,dbh\n1,2,3,0.3\n,5,6,0.3\nNA,NA,1,0.2\nmean,,,0.25\n4,-9999,1,0.2\n");
  REQUIRE(table.stems.size() == 1);
  CHECK(table.has_heights);
  REQUIRE(table.notes.size() == 1);
  CHECK(table.notes[0] == "4 rows without x and y are left out");
  const temporary_directory directory;
  require_error(directory.file("none.csv", "x,y\nNA,NA\n"), read_stems, "no row with x and y", "coordinates");
}

TEST_CASE("coordinates may be -99 and -999, which as radii are none") {
  const stem_table table = read_text("x,y,z,radius\n-99,-999,-99,-99\n1,2,3,-999\n");
  REQUIRE(table.stems.size() == 2);
  require_stem(table.stems[0], -99, -999, -99);
  CHECK(table.notes.empty());
  for (const stem_record& stem : table.stems) CHECK(std::isnan(stem.radius));
}

TEST_CASE("where a height is missing none is used, and that is said") {
  for (const char* missing : {"", "NA", "-9999", "null", "-", "nan"}) {
    const stem_table table = read_text(std::string("x,y,z\n1,2,3\n4,5,") + missing + "\n");
    REQUIRE(table.stems.size() == 2);
    CHECK_FALSE(table.has_heights);
    CHECK(table.stems[0].z == 0);
    REQUIRE(table.notes.size() == 1);
    CHECK(table.notes[0] == "z is missing in 1 of 2 rows: heights are not used");
  }
}

TEST_CASE("diameters and radii that no tree has in metres are in centimetres or millimetres") {
  CHECK(read_text("x,y,dbh\n1,2,30\n1,3,20\n").stems[0].radius == Approx(0.15));
  CHECK(read_text("x,y,radius\n1,2,15\n1,3,20\n").stems[0].radius == Approx(0.15));
  CHECK(read_text("x,y,dbh\n1,2,300\n1,3,420\n").stems[0].radius == Approx(0.15));
  CHECK(read_text("x,y,dbh_mm\n1,2,30\n1,3,20\n").stems[0].radius == Approx(0.015));
  CHECK(read_text("x,y,DBH [cm]\n1,2,1\n1,3,1.5\n").stems[0].radius == Approx(0.005));
  CHECK(read_text("x,y,dbh\n1,2,30\n").notes.size() == 1);
  CHECK(read_text("x,y,dbh\n1,2,0.3\n").notes.empty());
  CHECK(read_text("x,y,dbh_cm\n1,2,30\n").notes.empty());
}

TEST_CASE("a radius that is no length is refused with line and column") {
  const temporary_directory directory;
  for (const char* radius : {"thick", "-0.1", "inf"})
    require_error(directory.file("stems.csv", std::string("x,y,radius\n1,2,") + radius + "\n"), read_stems,
                  std::string("line 2 has '") + radius + "' in column radius", "metres");
}

TEST_CASE("a row with more or fewer fields than the header is refused") {
  const temporary_directory directory;
  require_error(directory.file("a.csv", "x,y,z\n1,5,2,5,3,5\n"), read_stems, "line 2 has 6 fields",
                "decimal points");
  require_error(directory.file("b.csv", "x,y,z\n1,2\n"), read_stems, "line 2 has 2 fields", "Mend");
  require_error(directory.file("c.csv", "x,y,z\n\"1,2,3\n"), read_stems, "line 2 has 1 fields", "quoted");
}

TEST_CASE("a file that is no stem map is refused with the header that one has") {
  const temporary_directory directory;
  require_error(directory.file("a.csv", ""), read_stems, "is empty", "x,y,z,radius");
  require_error(directory.file("b.csv", "1,2,3\n"), read_stems, "no line that names the columns",
                "x,y,z,radius");
  require_error(directory.file("c.csv", "x,z\n1,2\n"), read_stems,
                "names no columns that are known to be x and y: 'x,z'", "x,y,z,radius");
  require_error(directory.file("d.csv", std::string(100, '\0')), read_stems, "names no columns",
                "x,y,z,radius");
  require_error(directory / "none.csv", read_stems, "does not exist", "Check");
}

TEST_CASE("the stem maps of real forests are read") {
  const std::filesystem::path maps = std::filesystem::path(GLOBALMATCH_SHARED_DATA) / "stem_maps";
  if (!std::filesystem::is_directory(maps)) {
    WARN("skipped: the folder of real stem maps does not exist: " << maps);
    return;
  }
  CHECK(read_stems(maps / "boreal_48_sites.csv").stems.size() == 1721);
  CHECK(read_stems(maps / "bigwoods_dbh10cm.csv").stems.size() == 9226);
  CHECK(read_stems(maps / "rioja_01_tls.csv").stems.size() == 35);
}

}  // namespace globalmatch::support::test_stem_files

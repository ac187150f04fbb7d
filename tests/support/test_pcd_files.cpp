#include <cmath>
#include <cstdint>

#include "catch.hpp"
#include "file_checks.hpp"
#include "support/scan_files.hpp"

namespace globalmatch::support::test_pcd_files {

namespace {

const points two_points = {{1.5, -2, 3}, {4, 5.25, -6}};

// A label of 3 bytes before x, y, z, and an intensity after them.
std::string header(const std::string& count, const std::string& data) {
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS label x y z intensity\n"
         "SIZE 1 4 4 8 2\nTYPE U F F F U\nCOUNT 3 1 1 1 1\nWIDTH " +
         count + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + count + "\nDATA " + data + "\n";
}

void put_point(std::string& bytes, const Eigen::Vector3d& p) {
  bytes += "abc";
  put(bytes, static_cast<float>(p.x()));
  put(bytes, static_cast<float>(p.y()));
  put(bytes, p.z());
  put(bytes, std::uint16_t(9));
}

// The same points, field after field.
std::string fields_of_two_points() {
  std::string bytes = "abcabc";
  for (const Eigen::Vector3d& p : two_points) put(bytes, static_cast<float>(p.x()));
  for (const Eigen::Vector3d& p : two_points) put(bytes, static_cast<float>(p.y()));
  for (const Eigen::Vector3d& p : two_points) put(bytes, p.z());
  bytes += "\x09";
  bytes += std::string(1, '\0') + "\x09" + std::string(1, '\0');
  return bytes;
}

// LZF data of literal runs only, but for `abcabc` at the start: its second half is a copy of the first.
std::string packed(const std::string& plain) {
  std::string lzf = std::string("\x02") + "abc";
  lzf += std::string("\x20") + "\x02";  // 3 bytes from 3 back
  for (std::size_t at = 6; at < plain.size(); at += 32) {
    const std::string run = plain.substr(at, 32);
    lzf += static_cast<char>(run.size() - 1);
    lzf += run;
  }
  return lzf;
}

std::string compressed(const std::string& lzf, std::uint32_t plain_size, const std::string& count = "2") {
  std::string bytes = header(count, "binary_compressed");
  put(bytes, static_cast<std::uint32_t>(lzf.size()));
  put(bytes, plain_size);
  return bytes + lzf;
}

}  // namespace

TEST_CASE("an ascii PCD is read, with NaN points kept") {
  const temporary_directory directory;
  const std::string bytes =
      header("3", "ascii") + "97 98 99 1.5 -2 3 9\n97 98 99 4 5.25 -6 9\n0 0 0 nan nan nan 0\n";
  const points read = read_scan(directory.file("a.pcd", bytes));
  REQUIRE(read.size() == 3);
  CHECK(points(read.begin(), read.begin() + 2) == two_points);
  CHECK(std::isnan(read[2].x()));
}

TEST_CASE("a binary PCD is read past fields of several values") {
  const temporary_directory directory;
  std::string bytes = header("2", "binary");
  for (const Eigen::Vector3d& p : two_points) put_point(bytes, p);
  CHECK(read_scan(directory.file("a.pcd", bytes)) == two_points);
}

TEST_CASE("a compressed PCD is decompressed, literal runs and copies") {
  const temporary_directory directory;
  const std::string plain = fields_of_two_points();
  const auto size = static_cast<std::uint32_t>(plain.size());
  CHECK(read_scan(directory.file("a.pcd", compressed(packed(plain), size))) == two_points);
}

TEST_CASE("LZF copies may overlap themselves and be long") {
  const temporary_directory directory;
  // 25 zero points: three fields of 100 bytes, from one literal and two copies of it.
  const std::string start =
      "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 5\nHEIGHT 5\nDATA binary_compressed\n";
  std::string lzf(1, '\0');
  lzf += '\0';                                                    // a literal 0
  lzf += std::string("\xE0", 1) + "\xFF" + std::string(1, '\0');  // 264 bytes from 1 back
  lzf += std::string("\xE0", 1) + "\x1A" + std::string(1, '\0');  // 35 bytes from 1 back
  std::string bytes = start;
  put(bytes, static_cast<std::uint32_t>(lzf.size()));
  put(bytes, std::uint32_t(300));
  CHECK(read_scan(directory.file("a.pcd", bytes + lzf)) == points(25, Eigen::Vector3d::Zero()));
}

TEST_CASE("damaged compressed data are refused") {
  const temporary_directory directory;
  const std::string plain = fields_of_two_points();
  const auto size = static_cast<std::uint32_t>(plain.size());
  const auto require = [&](const std::string& bytes) {
    require_error(directory.file("a.pcd", bytes), read_scan, "damaged compressed data", "again");
  };
  const std::string good = packed(plain);
  require(compressed(good.substr(0, good.size() - 1), size));  // a literal run that ends early
  require(compressed(good, size + 1));                         // less data than announced
  require(compressed(good, size - 1));                         // more data than announced
  require(compressed(good, 4'000'000'000u));                   // more than LZF can yield
  require(compressed("\x20\x05", size));                       // a copy from before the start
  require(compressed(std::string("\0a\xE0", 3), size));        // a long copy that ends early
}

TEST_CASE("a PCD that announces more than it holds is refused before anything is allocated") {
  const temporary_directory directory;
  const std::string plain = fields_of_two_points();
  for (const char* count : {"3", "4000000000", "1000000000000000000", "18446744073709551615"}) {
    std::string binary = header(count, "binary");
    for (const Eigen::Vector3d& p : two_points) put_point(binary, p);
    require_error(directory.file("binary.pcd", binary), read_scan, "ends before", "again");
    require_error(directory.file("ascii.pcd", header(count, "ascii") + "1 1 1 1 2 3 1\n"), read_scan,
                  "ends before", "again");
    const std::string lzf = compressed(packed(plain), static_cast<std::uint32_t>(plain.size()), count);
    require_error(directory.file("packed.pcd", lzf), read_scan, "ends before", "again");
  }
  const std::string wide =
      "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 4294967296\nHEIGHT 4294967296\nDATA binary\n";
  require_error(directory.file("wide.pcd", wide + std::string(24, '\0')), read_scan, "ends before", "again");
  std::string cut = header("2", "binary_compressed");
  put(cut, std::uint32_t(1000));
  put(cut, std::uint32_t(50));
  require_error(directory.file("cut.pcd", cut + "abc"), read_scan, "ends before", "again");
}

TEST_CASE("a PCD without points is an empty scan") {
  const temporary_directory directory;
  for (const char* data : {"ascii", "binary"})
    CHECK(read_scan(directory.file("a.pcd", header("0", data))).empty());
}

TEST_CASE("a PCD that holds more than it announces is read as announced, and that is noted") {
  const temporary_directory directory;
  std::string binary = header("1", "binary");
  for (const Eigen::Vector3d& p : two_points) put_point(binary, p);
  for (const std::string& bytes : {binary, header("1", "ascii") + "1 1 1 1.5 -2 3 9\n1 1 1 4 5.25 -6 9\n"}) {
    const scan_file scan = open_scan(directory.file("a.pcd", bytes));
    CHECK(scan.size() == 1);
    REQUIRE(scan.header().notes.size() == 1);
    CHECK(scan.header().notes[0].find("announces 1 points") != std::string::npos);
  }
  put(binary, std::uint8_t(0));
  binary.replace(binary.find("POINTS 1"), 8, "POINTS 2");
  CHECK(open_scan(directory.file("a.pcd", binary)).header().notes.empty());
}

TEST_CASE("a PCD with tabs in its header and without a first comment is read") {
  const temporary_directory directory;
  const std::string bytes =
      "VERSION\t.7\nFIELDS\tx\ty\tz\nSIZE\t4\t4\t4\nTYPE\tF\tF\tF\nPOINTS\t2\nDATA\tascii\n";
  CHECK(read_scan(directory.file("a.pcd", bytes + "1.5\t-2\t3\n4 5.25 -6\n")) == two_points);
}

TEST_CASE("a PCD header that makes no sense is refused") {
  const temporary_directory directory;
  const auto require = [&](const std::string& bytes, const std::string& problem, const std::string& remedy) {
    require_error(directory.file("a.pcd", "# .PCD v0.7\n" + bytes), read_scan, problem, remedy);
  };
  require("FIELDS x y z\nSIZE 4 4 4\n", "without its DATA line", "again");
  require("FIELDS x y\nSIZE 4 4\nTYPE F F\nPOINTS 1\nDATA ascii\n1 2\n", "fields x, y and z", "Export");
  require("FIELDS x y z\nSIZE 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n1 2 3\n", "differ in length", "Export");
  require("FIELDS x y z\nTYPE F F F\nPOINTS 1\nDATA binary\n", "without SIZE or TYPE", "Export");
  require("FIELDS x y z\nSIZE 4 4 3\nTYPE F F F\nPOINTS 1\nDATA ascii\n1 2 3\n", "field 'z'", "Export");
  require("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 999999999999\nPOINTS 1\nDATA ascii\n1 2 3\n",
          "field 'z'", "Export");
  require("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS many\nDATA ascii\n1 2 3\n", "'many'", "Export");
  require("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nDATA ascii\n1 2 3\n", "without POINTS", "Export");
  require("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA zipped\n1 2 3\n", "'zipped'", "Export");
  require("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n1 zwei 3\n", "line 7 has 'zwei'",
          "decimal point");
}

}  // namespace globalmatch::support::test_pcd_files

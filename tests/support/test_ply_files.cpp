#include <cstdint>
#include <limits>

#include "catch.hpp"
#include "file_checks.hpp"
#include "support/scan_files.hpp"

namespace globalmatch::support::test_ply_files {

namespace {

const points two_points = {{1.5, -2, 3}, {4, 5.25, -6}};

std::string header(const std::string& format, const std::string& declarations) {
  return "ply\nformat " + format + " 1.0\ncomment of any kind\n" + declarations + "end_header\n";
}

const std::string xyz_float = "property float x\nproperty float y\nproperty float z\n";

// A value of every scalar type, each followed by x, y and z as double: reading must step over its very size.
template <class T>
std::string with_first_property(const std::string& type, const std::string& format, std::endian order) {
  std::string bytes = header(format, "element vertex 2\nproperty " + type +
                                         " first\nproperty double x\nproperty double y\nproperty double z\n"
                                         "property uchar last\n");
  for (const Eigen::Vector3d& p : two_points) {
    put(bytes, T(7), order);
    for (const double coordinate : p) put(bytes, coordinate, order);
    put(bytes, std::uint8_t(9), order);
  }
  return bytes;
}

template <class T>
std::string with_coordinates(const std::string& type) {
  std::string bytes = header("binary_little_endian", "element vertex 1\nproperty " + type + " z\nproperty " +
                                                         type + " x\nproperty " + type + " y\n");
  for (const int coordinate : {3, 1, 2}) put(bytes, T(coordinate));
  return bytes;
}

}  // namespace

TEST_CASE("an ascii PLY is read, with CRLF, blank lines and further properties too") {
  const temporary_directory directory;
  const std::string declarations =
      "element vertex 2\nproperty uchar red\n" + xyz_float + "property float nx\n";
  const std::string lf = header("ascii", declarations) + "9 1.5 -2 3 0\n\n8 4e0 5.25 -6 0\n";
  CHECK(read_scan(directory.file("lf.ply", lf)) == two_points);
  std::string crlf;
  for (const char c : lf) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  CHECK(read_scan(directory.file("crlf.ply", crlf)) == two_points);
}

TEST_CASE("a PLY property of any type before x does not shift the coordinates") {
  const temporary_directory directory;
  const auto [format, order] = GENERATE(table<std::string, std::endian>(
      {{"binary_little_endian", std::endian::little}, {"binary_big_endian", std::endian::big}}));
  const std::endian e = order;
  const std::string f = format;
  const auto require = [&](const std::string& bytes) {
    CHECK(read_scan(directory.file("a.ply", bytes)) == two_points);
  };
  for (const char* type : {"char", "int8"}) require(with_first_property<std::int8_t>(type, f, e));
  for (const char* type : {"uchar", "uint8"}) require(with_first_property<std::uint8_t>(type, f, e));
  for (const char* type : {"short", "int16"}) require(with_first_property<std::int16_t>(type, f, e));
  for (const char* type : {"ushort", "uint16"}) require(with_first_property<std::uint16_t>(type, f, e));
  for (const char* type : {"int", "int32"}) require(with_first_property<std::int32_t>(type, f, e));
  for (const char* type : {"uint", "uint32"}) require(with_first_property<std::uint32_t>(type, f, e));
  for (const char* type : {"float", "float32"}) require(with_first_property<float>(type, f, e));
  for (const char* type : {"double", "float64"}) require(with_first_property<double>(type, f, e));
}

TEST_CASE("PLY coordinates may be of any scalar type and in any order") {
  const temporary_directory directory;
  const auto require = [&](const std::string& bytes) {
    CHECK(read_scan(directory.file("a.ply", bytes)) == points{{1, 2, 3}});
  };
  require(with_coordinates<std::int8_t>("char"));
  require(with_coordinates<std::uint8_t>("uchar"));
  require(with_coordinates<std::int16_t>("short"));
  require(with_coordinates<std::uint16_t>("ushort"));
  require(with_coordinates<std::int32_t>("int"));
  require(with_coordinates<std::uint32_t>("uint"));
  require(with_coordinates<float>("float"));
  require(with_coordinates<double>("double"));
}

TEST_CASE("PLY lists among the vertices, and elements before and after them, are passed over") {
  const temporary_directory directory;
  const std::string declarations =
      "element camera 1\nproperty float fov\nproperty list uchar ushort pixels\n"
      "element nothing 1000000000000000000\n"
      "element vertex 2\nproperty list int double waves\n" +
      xyz_float +
      "property list uchar char echoes\n"
      "element face 1\nproperty list uchar int vertex_indices\n";
  std::string binary = header("binary_big_endian", declarations);
  const auto big = std::endian::big;
  put(binary, 60.0f, big);
  put(binary, std::uint8_t(2), big);
  put(binary, std::uint32_t(0), big);  // two pixels
  int waves = 3;
  for (const Eigen::Vector3d& p : two_points) {
    put(binary, std::int32_t(waves), big);
    for (int i = 0; i < waves; ++i) put(binary, 0.5, big);
    for (const double coordinate : p) put(binary, static_cast<float>(coordinate), big);
    put(binary, std::uint8_t(1), big);
    put(binary, std::int8_t(-1), big);
    waves = 0;
  }
  CHECK(read_scan(directory.file("binary.ply", binary)) == two_points);

  const std::string ascii =
      header("ascii", declarations) + "60 2 0 0\n3 0.5 0.5 0.5 1.5 -2 3 1 -1\n0 4 5.25 -6 2 7 7\n3 0 1 0\n";
  CHECK(read_scan(directory.file("ascii.ply", ascii)) == two_points);
}

TEST_CASE("a PLY without points is an empty scan") {
  const temporary_directory directory;
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"})
    CHECK(read_scan(directory.file("a.ply", header(format, "element vertex 0\n" + xyz_float))).empty());
}

TEST_CASE("a PLY that holds more than it announces is read as announced, and that is noted") {
  const temporary_directory directory;
  const auto notes_of = [&](const std::string& bytes) {
    return open_scan(directory.file("a.ply", bytes)).header().notes;
  };
  for (const std::string count : {"0", "1"}) {
    const std::string text =
        header("ascii", "element vertex " + count + "\n" + xyz_float) + "1 2 3\n4 5 6\n\n";
    CHECK(read_scan(directory.file("a.ply", text)).size() == (count == "1"));
    REQUIRE(notes_of(text).size() == 1);
    CHECK(notes_of(text)[0].find("announces " + count + " points") != std::string::npos);
    const std::string binary =
        header("binary_little_endian", "element vertex " + count + "\n" + xyz_float) + std::string(24, '\0');
    CHECK(read_scan(directory.file("a.ply", binary)).size() == (count == "1"));
    CHECK(notes_of(binary).size() == 1);
  }
  CHECK(notes_of(header("ascii", "element vertex 2\n" + xyz_float) + "1 2 3\n4 5 6\n \n").empty());
  CHECK(notes_of(header("binary_little_endian", "element vertex 2\n" + xyz_float) + std::string(26, '\0'))
            .empty());
  CHECK(notes_of(header("ascii", "element vertex 1\n" + xyz_float + "element face 1\nproperty int a\n") +
                 "1 2 3\n4\n")
            .empty());
}

TEST_CASE("a PLY is known by its content, whatever its name") {
  const temporary_directory directory;
  const std::string bytes = header("ascii", "element vertex 1\n" + xyz_float) + "1 2 3\n";
  for (const char* name : {"a.las", "a.laz", "a.pcd", "a.csv", "a"})
    CHECK(read_scan(directory.file(name, bytes)) == points{{1, 2, 3}});
}

TEST_CASE("a PLY larger than any block is read to its last point") {
  const temporary_directory directory;
  const std::size_t count = 200'000;
  std::string bytes = header("binary_little_endian", "element vertex " + std::to_string(count) + "\n" +
                                                         xyz_float + "property uchar odd_size\n");
  for (std::size_t i = 0; i < count; ++i) {
    for (const float shift : {0.0f, 0.25f, 0.5f}) put(bytes, static_cast<float>(i) + shift);
    put(bytes, std::uint8_t(1));
  }
  const points read = read_scan(directory.file("a.ply", bytes));
  REQUIRE(read.size() == count);
  bool all_equal = true;
  for (std::size_t i = 0; i < count; ++i) {
    const double first = static_cast<double>(i);
    all_equal = all_equal && read[i] == Eigen::Vector3d(first, first + 0.25, first + 0.5);
  }
  CHECK(all_equal);
}

TEST_CASE("a PLY that announces more than it holds is refused before anything is allocated") {
  const temporary_directory directory;
  for (const char* format : {"ascii", "binary_little_endian"}) {
    for (const char* count : {"3", "4000000000", "1000000000000000000", "18446744073709551615"}) {
      const std::string bytes =
          header(format, std::string("element vertex ") + count + "\n" + xyz_float) + "1 2 3\n4 5 6\n";
      require_error(directory.file("a.ply", bytes), read_scan, "ends before", "again");
    }
    const std::string before = header(format,
                                      "element other 1000000000000000000\nproperty list int float v\n"
                                      "element vertex 1\n" +
                                          xyz_float);
    require_error(directory.file("b.ply", before + std::string(100, '1')), read_scan, "ends before", "again");
  }
}

TEST_CASE("a PLY list longer than the file is refused") {
  const temporary_directory directory;
  std::string bytes =
      header("binary_little_endian", "element vertex 1\nproperty list int double waves\n" + xyz_float);
  std::string negative = bytes;
  put(bytes, std::int32_t(2'000'000'000));
  require_error(directory.file("long.ply", bytes + std::string(50, '\1')), read_scan, "ends before", "again");
  put(negative, std::int32_t(-1));
  require_error(directory.file("negative.ply", negative + std::string(50, '\1')), read_scan,
                "impossible length", "Export");
}

TEST_CASE("a PLY header that makes no sense is refused with its line") {
  const temporary_directory directory;
  const auto require = [&](const std::string& bytes, const std::string& problem, const std::string& remedy) {
    require_error(directory.file("a.ply", bytes), read_scan, problem, remedy);
  };
  const std::string ascii = "ply\nformat ascii 1.0\n";
  require(ascii + "element vertex 1\n" + xyz_float, "without its end_header", "again");
  require(ascii + "property list uchar int i\nelement vertex 1\n" + xyz_float + "end_header\n1 2 3\n",
          "line 3 declares a property before any element", "Export");
  require(ascii + "element vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n",
          "no single property 'z'", "Export");
  require(ascii + "element vertex 1\n" + xyz_float + "property float x\nend_header\n1 2 3 4\n",
          "no single property 'x'", "Export");
  require(ascii + "element face 1\n" + xyz_float + "end_header\n1 2 3\n", "no element 'vertex'", "Export");
  require(ascii + "element vertex -1\n", "line 3", "Export");
  require(ascii + "element vertex 99999999999999999999\n", "line 3", "Export");
  require(ascii + "element vertex 1\nproperty vec3 p\n", "unknown property type 'vec3'", "Export");
  require(ascii + "\x01\x02garbage\n", "line 3 is no line of a PLY header", "Export");
  require("ply\nformat binary 1.0\nelement vertex 0\n" + xyz_float + "end_header\n", "unknown PLY format",
          "Export");
}

TEST_CASE("an ascii PLY line that lacks a number is refused with its line") {
  const temporary_directory directory;
  const std::string start = header("ascii", "element vertex 2\n" + xyz_float);
  require_error(directory.file("short.ply", start + "1 2 3\n4 5\n1 1 1 1\n"), read_scan, "line 10", "Export");
  require_error(directory.file("word.ply", start + "1 2 three\n4 5 6\n"), read_scan, "line 9", "Export");
}

}  // namespace globalmatch::support::test_ply_files

#include "support/scan_writer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "catch.hpp"
#include "las_checks.hpp"
#include "support/scan_sets.hpp"
#include "written_scans.hpp"

namespace globalmatch::support::test_scan_writer {

namespace {

constexpr unsigned formats[] = {0, 1, 2, 3, 6, 7, 8};
const scan_options all_points_kept{.keep_marked = true, .attributes = true};

points points_of(const scan_file& scan) {
  return {scan.begin(), scan.end()};
}

std::string ply(const std::string& properties, std::size_t count, const std::string& records) {
  return "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(count) +
         "\nproperty double x\nproperty double y\nproperty double z\n" + properties + "end_header\n" +
         records;
}

void put_point(std::string& bytes, double x, double y, double z) {
  for (const double c : {x, y, z}) put(bytes, c);
}

las_header header_of(const std::filesystem::path& path) {
  return read_las_header(file_bytes(path));
}

// A PLY file of these points.
scan_file scan_of(const std::filesystem::path& path, const points& all) {
  write_ply(path, all);
  return open_scan(path);
}

}  // namespace

TEST_CASE("all attributes of LAS keep their bits as LAS and as LAZ") {
  const temporary_directory directory;
  for (const unsigned format : formats)
    for (const std::size_t extra_bytes : {0u, 3u})
      for (const char* extension : {".las", ".laz"}) {
        INFO("format " << format << ", extra bytes " << extra_bytes << ' ' << extension);
        const auto path = directory.file("a.las", made_las_bytes(format, extra_bytes, 9000));
        const auto out = directory / ("b" + std::string(extension));
        const scan_file scan = open_scan(path, all_points_kept);
        write_scan(out, scan, 2);
        const scan_file read = open_scan(out, all_points_kept);
        CHECK(points_of(read) == points_of(scan));
        CHECK(header_of(out).format == format);
        for (const attribute& a : scan.points().attributes())
          CHECK(numbers_of(read, a.name, 5000) == numbers_of(scan, a.name));
        CHECK(values_of(read, "scan") == std::vector<double>(9000, 1));
        CHECK((read.header().las->encoding & 1) == 1);
      }
}

TEST_CASE("attributes of LAS are properties of PLY, and come back from there") {
  const temporary_directory directory;
  for (const unsigned format : {3u, 8u}) {
    const scan_file scan =
        open_scan(directory.file("a.las", made_las_bytes(format, 2, 5000)), all_points_kept);
    write_scan(directory / "b.ply", scan);
    const scan_file read = open_scan(directory / "b.ply");
    CHECK(points_of(read) == points_of(scan));
    for (const attribute& a : scan.points().attributes()) {
      const bool is_color = a.name == "red" || a.name == "green" || a.name == "blue";
      CHECK(values_of(read, is_color ? "point_" + a.name : a.name) == values_of(scan, a.name));
    }
    CHECK(values_of(read, "red") == std::vector<double>(5000, 1));
    write_scan(directory / "c.laz", read);
    const scan_file again = open_scan(directory / "c.laz", all_points_kept);
    for (const char* name : {"intensity", "classification", "gps_time", "return_number", "withheld"})
      CHECK(values_of(again, name) == values_of(scan, name));
    CHECK(values_of(again, "extra_bytes[0]") == values_of(scan, "extra_bytes[0]"));
  }
}

TEST_CASE("scans are put into the frame of the first, behind each other, and told apart") {
  const temporary_directory directory;
  const scan_file target = open_scan(directory.file("t.las", made_las_bytes(1, 0, 700)), all_points_kept);
  const scan_file source = scan_of(directory / "s.ply", {{1, 2, 3}, {-4, 5.5, 6}});
  Eigen::Isometry3d transform = Eigen::Translation3d(-480'000, 5'010'000, 130) *
                                Eigen::AngleAxisd(0.4, Eigen::Vector3d(0.1, -0.2, 1).normalized());
  const placed_scan placed[] = {{&target, Eigen::Isometry3d::Identity(), {10, 20, 30}},
                                {&source, transform, {40, 50, 60}}};
  for (const char* name : {"m.ply", "m.las", "m.laz"}) {
    INFO(name);
    write_scans(directory / name, placed, 2);
    const scan_file merged = open_scan(directory / name, all_points_kept);
    const points all = points_of(merged), expected = points_of(target);
    REQUIRE(all.size() == 702);
    CHECK(std::equal(expected.begin(), expected.end(), all.begin()));
    const bool is_ply = merged.header().las == std::nullopt;
    const Eigen::Vector3d step = is_ply ? Eigen::Vector3d::Zero() : merged.header().las->scale;
    for (const std::size_t i : {0u, 1u}) {
      const Eigen::Vector3d error = transform * *(source.begin() + std::ptrdiff_t(i)) - all[700 + i];
      CHECK((error.cwiseAbs() - 0.501 * step).maxCoeff() <= 0);
    }
    const std::vector<double> number = values_of(merged, is_ply ? "green" : "scan");
    CHECK(number[699] == (is_ply ? 20 : 1));
    CHECK(number[700] == (is_ply ? 50 : 2));
    CHECK(values_of(merged, "intensity")[701] == 0);
  }
}

TEST_CASE("attributes of other formats take their places in LAS, or are extra bytes") {
  const temporary_directory directory;
  std::string records;
  for (int i = 0; i < 300; ++i) {
    put_point(records, i, 0.1 * i, 2);
    put(records, static_cast<float>(i) / 299.0f);
    put(records, static_cast<std::uint8_t>(i % 256));
    put(records, static_cast<std::uint8_t>(i % 7));
    put(records, static_cast<std::uint8_t>(3));
    put(records, static_cast<std::int32_t>(i % 40));
    put(records, 3e8 + i * 1e-6);
    put(records, static_cast<float>(-i) * 0.1f);
    put(records, static_cast<float>(i) - 0.5f);
  }
  const std::string properties =
      "property float scalar_Intensity\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property int Classification\nproperty double GpsTime\nproperty float Reflectance\nproperty float "
      "user_data\n";
  const scan_file scan = open_scan(directory.file("a.ply", ply(properties, 300, records)));
  write_scan(directory / "b.las", scan);
  const scan_file read = open_scan(directory / "b.las", all_points_kept);
  CHECK(header_of(directory / "b.las").format == 7);  // for classes of 32 and more
  for (std::size_t i : {0u, 1u, 150u, 299u}) {
    CHECK(values_of(read, "intensity")[i] == std::round(double(float(i) / 299.0f) * 65535));
    CHECK(values_of(read, "red")[i] == 257.0 * double(i % 256));
    CHECK(values_of(read, "classification")[i] == double(i % 40));
    CHECK(values_of(read, "gps_time")[i] == 3e8 + double(i) * 1e-6);
    CHECK(values_of(read, "Reflectance")[i] == double(float(-int(i)) * 0.1f));
    CHECK(values_of(read, "user_data_value")[i] == double(i) - 0.5);
  }
  CHECK(header_of(directory / "b.las").scale == Eigen::Vector3d(1e-4, 1e-4, 1e-4));
}

TEST_CASE("an attribute that does not fit in one scan keeps its place in the other") {
  const temporary_directory directory;
  const scan_file target = open_scan(directory.file("t.las", made_las_bytes(6, 0, 10)), all_points_kept);
  std::string record;
  put_point(record, -500'000, 5'000'000, 100);
  put(record, -12.5f);
  const scan_file source =
      open_scan(directory.file("s.ply", ply("property float intensity\n", 1, record)), all_points_kept);
  const placed_scan placed[] = {{&target, Eigen::Isometry3d::Identity(), {}},
                                {&source, Eigen::Isometry3d::Identity(), {}}};
  write_scans(directory / "m.las", placed);
  const scan_file merged = open_scan(directory / "m.las", all_points_kept);
  CHECK(numbers_of(merged, "intensity").starts_with(numbers_of(target, "intensity")));
  const std::vector<double> values = values_of(merged, "intensity_value");
  REQUIRE(values.size() == 11);
  CHECK(std::all_of(values.begin(), values.begin() + 10, [](double v) { return std::isnan(v); }));
  CHECK(values.back() == -12.5);
}

TEST_CASE("attributes that one scan does not have are not-a-number there, and 0 where they are integers") {
  const temporary_directory directory;
  std::string first, second;
  put_point(first, 1, 2, 3);
  for (const float value : {4.f, 5.f}) put(first, value);
  put(first, std::uint8_t(6));
  put_point(second, 7, 8, 9);
  put(second, 10.5);
  const scan_file with = open_scan(directory.file(
      "a.ply",
      ply("property float reflectance\nproperty float deviation\nproperty uchar count\n", 1, first)));
  const scan_file without = open_scan(directory.file("b.ply", ply("property double planarity\n", 1, second)));
  const placed_scan placed[] = {{&with, Eigen::Isometry3d::Identity(), {}},
                                {&without, Eigen::Isometry3d::Identity(), {}}};
  for (const char* name : {"m.ply", "m.las"}) {
    INFO(name);
    write_scans(directory / name, placed);
    const scan_file merged = open_scan(directory / name);
    CHECK(values_of(merged, "deviation")[0] == 5);
    CHECK(std::isnan(values_of(merged, "deviation")[1]));
    CHECK(std::isnan(values_of(merged, "planarity")[0]));
    CHECK(values_of(merged, "planarity")[1] == 10.5);
    CHECK(values_of(merged, "count") == std::vector<double>{6, 0});
    CHECK(points_of(merged) == points{{1, 2, 3}, {7, 8, 9}});
  }
}

TEST_CASE("text, PTX, PTS, PCD and tiles give their attributes") {
  const temporary_directory directory;
  const auto values = [&](const std::filesystem::path& path, const std::string& name) {
    write_scan(directory / "out.las", open_scan(path, all_points_kept));
    return values_of(open_scan(directory / "out.las"), name);
  };
  using numbers = std::vector<double>;
  CHECK(values(directory.file("a.csv", "y,x,Intensity,z,my value\n1,2,30,4,0.5\n5,6,70,8,x\n"),
               "intensity") == numbers{30, 70});
  CHECK(values(directory / "a.csv", "my_value")[0] == 0.5);
  CHECK(std::isnan(values(directory / "a.csv", "my_value")[1]));
  CHECK(values(directory.file("a.xyz", "1 2 3 9\n4 5 6 8\n"), "intensity") == numbers{9, 8});
  CHECK(values(directory.file("a.pts", "2\n1 2 3 9 255 0 1\n4 5 6 8 0 0 2\n"), "red") == numbers{65535, 0});
  const std::string ptx = "1\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
  CHECK(values(directory.file("a.ptx", ptx + "0 0 0 0.5\n1 2 3 0.25\n"), "intensity") == numbers{16384});
  const std::string pcd =
      "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb label\nSIZE 4 4 4 4 4\nTYPE F F F F U\n"
      "COUNT 1 1 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ";
  std::string record;
  for (const float c : {1.0f, 2.0f, 3.0f}) put(record, c);
  put(record, std::uint32_t(0x00'10'20'30));
  put(record, std::uint32_t(70'000));
  CHECK(values(directory.file("a.pcd", pcd + "binary\n" + record), "green") == numbers{257 * 0x20});
  CHECK(values(directory / "a.pcd", "label") == numbers{70'000});
  CHECK(values(directory.file("b.pcd", pcd + "ascii\n1 2 3 0 5\n"), "label") == numbers{5});
  CHECK(values(directory.file("a.ply",
                              "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                              "property float z\nproperty uchar intensity\nend_header\n1 2 3 7\n"),
               "intensity") == numbers{7});
  std::filesystem::create_directory(directory / "tiles");
  directory.file("tiles/1.las", made_las_bytes(3, 1, 50));
  directory.file("tiles/2.las", made_las_bytes(3, 1, 5000));
  write_scan(directory / "t.laz", scan_file(open_tiles(directory / "tiles", all_points_kept)));
  const scan_file one = open_scan(directory / "tiles/2.las", all_points_kept);
  const scan_file both = open_scan(directory / "t.laz", all_points_kept);
  REQUIRE(both.size() == 5050);
  for (const char* name : {"gps_time", "extra_bytes[0]"})
    CHECK(numbers_of(both, name).ends_with(numbers_of(one, name)));
}

TEST_CASE("points that are left out are not written") {
  const temporary_directory directory;
  const double none = std::numeric_limits<double>::quiet_NaN();
  const scan_file scan = scan_of(directory / "a.ply", {{none, 0, 0}, {1, 2, 3}, {none, 1, 1}});
  const auto path = directory.file("a.las", made_las_bytes(6, 0, 1000));
  for (const char* name : {"b.ply", "b.las", "b.laz"}) {
    write_scan(directory / name, scan);
    CHECK(read_scan(directory / name) == points{{1, 2, 3}});
    write_scan(directory / name, open_scan(path));
    CHECK(open_scan(directory / name, all_points_kept).size() == read_las_file(path).size());
  }
}

TEST_CASE("scans without points are files without points") {
  const temporary_directory directory;
  const scan_file none = scan_of(directory / "a.ply", {});
  const scan_file las = open_scan(directory.file("a.las", made_las_bytes(8, 2, 0)));
  for (const char* name : {"b.ply", "b.las", "b.laz"})
    for (const scan_file* scan : {&none, &las}) {
      INFO(name);
      write_scan(directory / name, *scan, 3);
      CHECK(open_scan(directory / name).empty());
    }
}

TEST_CASE("steps are coarser where 32 bits do not hold the extent in fine ones") {
  const temporary_directory directory;
  for (const auto& [extent, step] : {std::pair(1e5, 1e-4), {1e6, 1e-3}, {1e7, 1e-2}}) {
    const points all = {{-extent, 0, 7e6}, {extent, 1, 7e6 + extent}, {0.1234, 2, 7e6}};
    for (const char* name : {"b.las", "b.laz"}) {
      INFO(name << ' ' << extent);
      write_scan(directory / name, scan_of(directory / "a.ply", all));
      const las_header header = header_of(directory / name);
      CHECK(header.scale.x() == Approx(step));
      CHECK(header.scale.y() == Approx(1e-4));
      const points read = read_scan(directory / name);
      REQUIRE(read.size() == 3);
      for (std::size_t i = 0; i < 3; ++i) CHECK((read[i] - all[i]).cwiseAbs().maxCoeff() <= 0.51 * step);
    }
  }
}

TEST_CASE("coordinates that no steps hold are an error, and nothing is left behind") {
  const temporary_directory directory;
  for (const double far : {1e9, 1e30, 1e308}) {
    const scan_file scan = scan_of(directory / "a.ply", {{0, 0, 0}, {far, 0, -far}});
    for (const char* name : {"b.las", "b.laz"})
      require_error(
          directory / name, [&](const auto& p) { write_scan(p, scan); }, "cannot hold coordinates",
          "Remove stray points");
    CHECK(directory.count_files() == 1);
  }
}

TEST_CASE("a merged file that cannot be written whole is not written") {
  const temporary_directory directory;
  const scan_file scan = open_scan(directory.file("a.las", made_las_bytes(1, 0, 2000)));
  std::filesystem::resize_file(directory / "a.las", 30'000);
  for (const char* name : {"b.ply", "b.las", "b.laz"}) {
    CHECK_THROWS_AS(write_scan(directory / name, scan), file_error);
    CHECK(directory.count_files() == 1);
    CHECK_THROWS_AS(write_scan(directory / "none" / name, scan), file_error);
  }
  require_error(
      directory / "b.e57", [&](const auto& p) { write_scan(p, scan); }, "no extension", "Name it .ply");
}

TEST_CASE("files are the same for any number of threads") {
  const temporary_directory directory;
  const scan_file scan =
      open_scan(directory.file("a.las", made_las_bytes(7, 2, 70'000)), {.attributes = true});
  for (const char* extension : {".ply", ".las", ".laz"}) {
    write_scan(directory / (std::string("one") + extension), scan, 1);
    write_scan(directory / (std::string("four") + extension), scan, 4);
    CHECK(bytes_of(directory / (std::string("one") + extension)) ==
          bytes_of(directory / (std::string("four") + extension)));
  }
}

TEST_CASE("more scans than a byte can number are told apart in LAS") {
  const temporary_directory directory;
  const scan_file scan = scan_of(directory / "s.ply", {{1, 2, 3}});
  const std::vector<placed_scan> placed(300, {&scan, Eigen::Isometry3d::Identity(), {}});
  write_scans(directory / "m.laz", placed, 2);
  const std::vector<double> numbers = values_of(open_scan(directory / "m.laz", all_points_kept), "scan");
  REQUIRE(numbers.size() == 300);
  for (std::size_t i = 0; i < numbers.size(); ++i) CHECK(numbers[i] == double(i + 1));
}

}  // namespace globalmatch::support::test_scan_writer

#include "support/posed_copies.hpp"

#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "e57_writer.hpp"
#include "file_checks.hpp"
#include "support/transform_forms.hpp"

namespace globalmatch::support::test_posed_copies {

namespace {

Eigen::Isometry3d a_pose() {
  return Eigen::Translation3d(691'234.5, -7.25, 0.1) *
         Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.2, -0.1, 1).normalized());
}

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Scans of some points, of which `without_pose` has no pose.
std::string e57_of(std::size_t scans, std::size_t points_of_each, std::size_t without_pose) {
  std::vector<written_scan> written;
  for (std::size_t s = 0; s < scans; ++s) {
    std::vector<double> x, y, z;
    for (std::size_t i = 0; i < points_of_each; ++i) {
      x.push_back(double(i) + 100 * double(s));
      y.push_back(0.5 * double(i));
      z.push_back(-double(i));
    }
    written.push_back(
        {{double_field("cartesianX", x), double_field("cartesianY", y), double_field("cartesianZ", z)}});
    if (s != without_pose)
      written.back().pose = e57_pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 2, double(s)));
  }
  return e57_file(written);
}

const std::string ptx_pose = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
const std::string ptx_points = "1.5 -2 3 0.5\n0 0 0 0.5\n";

std::optional<Eigen::Isometry3d> pose_in(const std::filesystem::path& path) {
  return open_scan(path).header().pose;
}

std::string with_crlf(const std::string& text) {
  std::string changed;
  for (const char c : text) changed += c == '\n' ? std::string("\r\n") : std::string(1, c);
  return changed;
}

}  // namespace

TEST_CASE("a copy of an E57 file has the pose, the points, and the other scans as they were") {
  const temporary_directory directory;
  for (const std::size_t points_of_each : {3u, 700u})
    for (const std::size_t scans : {1u, 3u}) {
      CAPTURE(points_of_each, scans);
      const auto path = directory.file("a.e57", e57_of(scans, points_of_each, 0));
      const auto copy = directory / "copy.e57";
      for (std::size_t posed = 1; posed <= scans; ++posed) {
        const auto name = [&](const std::filesystem::path& file, std::size_t scan) {
          return scans == 1 ? file : std::filesystem::path(file.string() + '#' + std::to_string(scan));
        };
        write_posed_copy(copy, name(path, posed), a_pose());
        for (std::size_t scan = 1; scan <= scans; ++scan) {
          CHECK(read_scan(name(copy, scan)) == read_scan(name(path, scan)));
          const auto pose = pose_in(name(copy, scan)), before = pose_in(name(path, scan));
          if (scan == posed) {
            REQUIRE(pose);
            CHECK(pose->isApprox(a_pose(), 1e-15));
          } else {
            REQUIRE(pose.has_value() == before.has_value());
            if (pose) CHECK(pose->matrix() == before->matrix());
          }
        }
      }
    }
}

TEST_CASE("a description that is not last in its file goes unread in the copy") {
  const temporary_directory directory;
  std::string bytes = e57_of(1, 10, 1);
  const std::size_t pages = bytes.size() / 1024;
  bytes += std::string(1024, '\0');
  put_at<std::uint64_t>(bytes, 16, (pages + 1) * 1024);
  seal_pages(bytes);
  const auto path = directory.file("a.e57", bytes), copy = directory / "copy.e57";
  write_posed_copy(copy, path, a_pose());
  CHECK(read_scan(copy) == read_scan(path));
  REQUIRE(pose_in(copy));
  CHECK(pose_in(copy)->isApprox(a_pose(), 1e-15));
  CHECK(bytes_of(copy).size() > bytes.size());
}

TEST_CASE("what shares the last page with the description stays") {
  const temporary_directory directory;
  std::string bytes = e57_of(1, 10, 1);
  REQUIRE(bytes.substr(bytes.size() - 12, 8) == std::string(8, '\0'));
  bytes.replace(bytes.size() - 12, 8, "a picture");  // of which a byte is lost to the checksum
  seal_pages(bytes);
  const auto path = directory.file("a.e57", bytes), copy = directory / "copy.e57";
  write_posed_copy(copy, path, a_pose());
  CHECK(bytes_of(copy).find("a pictur") != std::string::npos);
  REQUIRE(pose_in(copy));
  CHECK(pose_in(copy)->isApprox(a_pose(), 1e-15));
}

TEST_CASE("the pictures of a scan move with it, and those of others stay") {
  const temporary_directory directory;
  std::string bytes = e57_of(1, 10, 9);  // its pose is a shift by (1, 2, 0), and its guid {2}
  const std::string empty = "<images2D type=\"Vector\" allowHeterogeneousChildren=\"1\"/>";
  const auto picture = [](const std::string& guid) {
    return "<vectorChild type=\"Structure\"><associatedData3DGuid type=\"String\"><![CDATA[" + guid +
           "]]></associatedData3DGuid>" + e57_pose(Eigen::Quaterniond::Identity(), {1, 2, 5}) +
           "</vectorChild>";
  };
  std::string content;
  for (std::size_t page = 0; page < bytes.size(); page += 1024) content += bytes.substr(page, 1020);
  const std::size_t xml = content.find("<?xml"), end = content.find(empty);
  REQUIRE(end != std::string::npos);
  content.replace(end, empty.size(),
                  "<images2D type=\"Vector\">" + picture("{2}") + picture("{3}") + "</images2D>");
  content.resize(content.find('\0', end));
  put_at<std::uint64_t>(content, 32, content.size() - xml);
  content.resize((content.size() + 1019) / 1020 * 1020);
  put_at<std::uint64_t>(content, 16, content.size() / 1020 * 1024);
  bytes.clear();
  for (std::size_t page = 0; page < content.size(); page += 1020)
    bytes += content.substr(page, 1020) + std::string(4, '\0');
  seal_pages(bytes);
  const auto path = directory.file("a.e57", bytes), copy = directory / "copy.e57";
  write_posed_copy(copy, path, Eigen::Isometry3d(Eigen::Translation3d(11, 22, 33)));
  std::string copied;
  const std::string all = bytes_of(copy);
  for (std::size_t page = 0; page < all.size(); page += 1024) copied += all.substr(page, 1020);
  const std::string images = copied.substr(copied.rfind("<images2D"));
  CHECK(images.find("<x type=\"Float\">11</x><y type=\"Float\">22</y><z type=\"Float\">38</z>") !=
        std::string::npos);
  CHECK(images.find("<x type=\"Float\">1</x><y type=\"Float\">2</y><z type=\"Float\">5</z>") !=
        std::string::npos);
}

TEST_CASE("the scanner's place and axes of a PTX file turn with its matrix") {
  const temporary_directory directory;
  const std::string elsewhere = "5 6 7\n0 1 0\n-1 0 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
  const auto path = directory.file("a.ptx", "1\n2\n" + elsewhere + ptx_points), copy = directory / "b.ptx";
  write_posed_copy(copy, path, Eigen::Isometry3d(Eigen::Translation3d(10, 20, 30)));
  CHECK(bytes_of(copy).starts_with("1\n2\n15 26 37\n0 1 0\n-1 0 0\n0 0 1\n"));
}

TEST_CASE("a copy of a copy with the pose as it was has no more bytes than the first") {
  const temporary_directory directory;
  const auto path = directory.file("a.e57", e57_of(2, 10, 9));
  write_posed_copy(directory / "1.e57", path.string() + "#2", a_pose());
  write_posed_copy(directory / "2.e57", (directory / "1.e57").string() + "#2", a_pose());
  CHECK(bytes_of(directory / "1.e57") == bytes_of(directory / "2.e57"));
}

TEST_CASE("a copy of a PTX file differs in the eight lines of the pose alone, whatever ends them") {
  const temporary_directory directory;
  const std::string text = "1\n2\n" + ptx_pose + ptx_points + "\n2\n1\n" + ptx_pose + ptx_points;
  for (const bool crlf : {false, true}) {
    const std::string given = crlf ? with_crlf(text) : text;
    const auto path = directory.file("a.ptx", given), copy = directory / "copy.ptx";
    for (const std::size_t posed : {1u, 2u}) {
      CAPTURE(crlf, posed);
      write_posed_copy(copy, path.string() + '#' + std::to_string(posed), a_pose());
      for (const std::size_t scan : {1u, 2u}) {
        const std::string number = '#' + std::to_string(scan);
        CHECK(read_scan(copy.string() + number) == read_scan(path.string() + number));
        const auto pose = pose_in(copy.string() + number);
        REQUIRE(pose);
        CHECK(pose->isApprox(scan == posed ? a_pose() : Eigen::Isometry3d::Identity(), 1e-12));
      }
      std::istringstream before(given), after(bytes_of(copy));
      std::string line_before, line_after;
      std::size_t lines = 0, different = 0;
      while (std::getline(before, line_before)) {
        REQUIRE(std::getline(after, line_after));
        CHECK(line_after.ends_with('\r') == crlf);
        ++lines, different += line_before != line_after;
      }
      CHECK_FALSE(std::getline(after, line_after));
      CHECK(lines == 25);
      CHECK(different == 8);
    }
  }
}

TEST_CASE("some scans of a file, in any order, have other poses in its copy, and the rest as it was") {
  const temporary_directory directory;
  const std::string block = "1\n2\n" + ptx_pose + ptx_points;
  const auto ptx = directory.file("a.ptx", block + block + block + block),
             e57 = directory.file("a.e57", e57_of(4, 5, 9));
  const Eigen::Isometry3d other(Eigen::Translation3d(3, 1, -2));
  const scan_pose poses[] = {{3, a_pose()}, {2, other}};
  for (const auto& path : {ptx, e57}) {
    CAPTURE(path);
    const auto copy = directory / ("copy" + path.extension().string());
    write_posed_copy(copy, path, poses);
    REQUIRE(scans_in(copy).size() == 4);
    for (std::size_t k = 1; k <= 4; ++k) {
      const std::string number = '#' + std::to_string(k);
      CHECK(read_scan(copy.string() + number) == read_scan(path.string() + number));
      const auto pose = pose_in(copy.string() + number), before = pose_in(path.string() + number);
      REQUIRE((pose && before));
      CHECK(pose->isApprox(k == 3 ? a_pose() : k == 2 ? other : *before, 1e-12));
    }
  }
  const scan_pose absent[] = {{1, other}, {5, other}};
  for (const auto& path : {ptx, e57})
    CHECK_THAT(error_of([&] { write_posed_copy(directory / "b", path, absent); }),
               Catch::Contains("no scan 5"));
}

TEST_CASE("what is no such file, the file itself, and scans that are not there are refused") {
  const temporary_directory directory;
  const auto ptx = directory.file("a.ptx", "1\n2\n" + ptx_pose + ptx_points),
             e57 = directory.file("a.e57", e57_of(1, 3, 1)), text = directory.file("a.txt", "1 2 3\n4 5 6\n");
  const auto refusal = [](const std::filesystem::path& copy, const std::filesystem::path& source) {
    return error_of([&] { require_posed_copy(copy, source); });
  };
  CHECK_THAT(refusal(directory / "b.e57", ptx), Catch::Contains("b.e57") && Catch::Contains("no E57 file"));
  CHECK_THAT(refusal(directory / "b.ptx", e57), Catch::Contains("no PTX file"));
  CHECK_THAT(refusal(directory / "b.ptx", text), Catch::Contains("no PTX file"));
  const auto utf16 = directory.file("b.ptx", std::string("\xff\xfe") + "1\0\n\0");
  CHECK_THAT(refusal(directory / "c.ptx", utf16), Catch::Contains("c.ptx"));
  CHECK_THAT(error_of([&] { require_rewritable(directory / "c.ptx", utf16); }), Catch::Contains("UTF-16"));
  CHECK_NOTHROW(require_rewritable(directory / "c.ptx", ptx));
  const std::filesystem::path one[] = {ptx};
  for (const auto& files : {std::pair(ptx, text), std::pair(text, ptx)})
    CHECK_THAT(error_of([&] { require_forms(one, files.first.string() + "#1", files.second); }),
               Catch::Contains("is one of the files"));
  CHECK(refusal(directory / "b.PTX", ptx).empty());
  CHECK(refusal(directory / "b.e57", e57.string() + "#1").empty());
  const auto copy = directory / "copy.ptx";
  CHECK_THAT(error_of([&] { write_posed_copy(copy, ptx.string() + "#2", a_pose()); }),
             Catch::Contains("no scan 2"));
  CHECK_FALSE(std::filesystem::exists(copy));
}

TEST_CASE("a copy with the pose of one scan of several says that the others keep theirs") {
  const temporary_directory directory;
  const std::string scan = "1\n2\n" + ptx_pose + ptx_points;
  const auto one = directory.file("one.ptx", scan), two = directory.file("two.ptx", scan + scan);
  const auto line_for = [&](const std::string& source) {
    return write_transform_form(directory / "copy.ptx", a_pose(), Eigen::Vector3d::Zero(), source);
  };
  CHECK_THAT(line_for(two.string() + "#2"), Catch::Contains("the others keep theirs"));
  CHECK_THAT(line_for(one.string()), !Catch::Contains("the others keep theirs"));
}

TEST_CASE("as a form of a transform the pose is that of the target times the transform") {
  const temporary_directory directory;
  const auto path = directory.file("a.ptx", "1\n2\n" + ptx_pose + ptx_points), copy = directory / "b.ptx";
  const std::filesystem::path forms[] = {copy};
  require_forms(forms, path, "t.ptx");
  const Eigen::Isometry3d target_from_source(Eigen::Translation3d(1, 2, 3));
  std::ostringstream printed;
  write_or_remove_forms(forms, target_from_source, Eigen::Vector3d::Zero(), path, printed,
                        {Eigen::Isometry3d::Identity(), a_pose()});
  CHECK(printed.str().find(copy.string()) != std::string::npos);
  REQUIRE(pose_in(copy));
  CHECK(pose_in(copy)->isApprox(a_pose() * target_from_source, 1e-12));
  CHECK_THAT(error_of([&] { require_forms(forms, directory / "stems.csv", path); }),
             Catch::Contains("stems.csv"));
}

}  // namespace globalmatch::support::test_posed_copies

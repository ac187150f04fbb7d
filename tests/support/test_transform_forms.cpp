#include "support/transform_forms.hpp"

#include <nlohmann/json.hpp>

#include <sstream>
#include <string>
#include <vector>

#include "catch.hpp"
#include "file_checks.hpp"
#include "support/transform_files.hpp"

namespace globalmatch::support::test_transform_forms {

namespace {

const Eigen::Vector3d in_utm(691'234.5, 5'334'567.8, 512.3);

Eigen::Isometry3d a_transform() {
  return Eigen::Translation3d(3.25, -7.5, 0.125) * Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ());
}

}  // namespace

TEST_CASE("a transform about a place near the points is the same transform") {
  for (const Eigen::Vector3d& near_points : {Eigen::Vector3d(3, 4, 5), in_utm}) {
    const Eigen::Isometry3d transform =
        Eigen::Translation3d(near_points) * a_transform() * Eigen::Translation3d(-near_points);
    const centred_transform centred = centre(transform, near_points);
    const Eigen::Vector3d p = near_points + Eigen::Vector3d(11, -20, 3);
    const Eigen::Vector3d q = centred.rotation * (p - centred.center) + centred.center + centred.shift;
    CHECK((q - transform * p).norm() < 1e-8);
    CHECK((p - centred.center).cwiseAbs().maxCoeff() < 1000);
    CHECK(centred.shift.norm() < 100);
  }
  CHECK(centre(a_transform(), {999, -999, 0}).center == Eigen::Vector3d::Zero());
  CHECK(centre(a_transform(), in_utm).center == Eigen::Vector3d(691'200, 5'334'600, 500));
}

TEST_CASE("single precision keeps a tenth of a millimetre of a centred transform") {
  const Eigen::Isometry3d transform =
      Eigen::Translation3d(in_utm) * a_transform() * Eigen::Translation3d(-in_utm);
  const centred_transform centred = centre(transform, in_utm);
  const Eigen::Vector3d p = in_utm + Eigen::Vector3d(25, 30, -2);
  const Eigen::Vector3f q =
      centred.rotation.cast<float>() * (p - centred.center).cast<float>() + centred.shift.cast<float>();
  CHECK((q.cast<double>() + centred.center - transform * p).norm() < 1e-4);
}

TEST_CASE("matrices for CloudCompare and RiSCAN PRO are four lines of four numbers") {
  const temporary_directory directory;
  for (const char* name : {"t.mat.txt", "T.CC.TXT", "t.dat"}) {
    const std::string line = write_transform_form(directory / name, a_transform(), {1, 2, 3}, "my scan.ply");
    CHECK(read_transform(directory / name).matrix() == a_transform().matrix());
    CHECK(line.find("\"my scan.ply\"") != std::string::npos);
    CHECK(line.find((directory / name).string()) != std::string::npos);
    CHECK(line.find('\n') == std::string::npos);
  }
  CHECK(write_transform_form(directory / "t.cc.txt", a_transform(), {1, 2, 3}, "s.ply") ==
        "CloudCompare -SILENT -O \"s.ply\" -APPLY_TRANS \"" + (directory / "t.cc.txt").string() +
            "\" -SAVE_CLOUDS");
}

TEST_CASE("large coordinates are shifted before CloudCompare transforms them, and that is said") {
  const temporary_directory directory;
  const std::filesystem::path paths[] = {directory / "t.mat.txt", directory / "t.dat"};
  std::ostringstream said;
  write_or_remove_forms(paths, a_transform(), in_utm, "s.las", said);
  CHECK(said.str().find("-O -GLOBAL_SHIFT -691200 -5334600 -500 \"s.las\"") != std::string::npos);
  CHECK(said.str().find("c = 691200 5334600 500") != std::string::npos);
  const centred_transform centred = centre(a_transform(), in_utm);
  CHECK(read_transform(paths[0]).translation() == centred.shift);
  CHECK(read_transform(paths[1]).matrix() == a_transform().matrix());
}

TEST_CASE("the pipeline for PDAL reads the source and writes it beside") {
  const temporary_directory directory;
  const auto path = directory / "t.json";
  CHECK(write_transform_form(path, a_transform(), in_utm, "d/s.laz") ==
        "pdal pipeline \"" + path.string() + "\"");
  const auto pipeline = nlohmann::json::parse(bytes_of(path));
  REQUIRE(pipeline.size() == 3);
  CHECK(pipeline[0] == "d/s.laz");
  CHECK(pipeline[1]["type"] == "filters.transformation");
  CHECK(pipeline[2]["filename"] == "d/s_registered.laz");
  std::istringstream numbers(pipeline[1]["matrix"].get<std::string>());
  for (Eigen::Index i = 0; i < 16; ++i) {
    double number = 0;
    REQUIRE(numbers >> number);
    CHECK(number == a_transform().matrix()(i / 4, i % 4));
  }
  write_transform_form(path, a_transform(), in_utm, "s.ptx");
  CHECK(nlohmann::json::parse(bytes_of(path))[2]["filename"] == "s_registered.laz");
  require_error(
      path, [&](const auto& p) { write_transform_form(p, a_transform(), in_utm, "s.e57#2"); }, "scan s.e57#2",
      "Export that scan");
}

TEST_CASE("forms of other names are refused, and without a transform earlier ones are removed") {
  const temporary_directory directory;
  const std::vector<std::filesystem::path> known = {directory.file("t.dat", "old"), directory / "t.json"};
  require_forms(known, "s.ply", "t.ply");
  CHECK(bytes_of(known[0]) == "old");
  for (const char* name : {"t.txt", "t", "t.xml"}) {
    const std::vector<std::filesystem::path> other = {directory / name};
    require_error(
        other[0], [&](const auto&) { require_forms(other, "s.ply", "t.ply"); }, "no ending",
        "Name it .mat.txt");
  }
  std::ostringstream said;
  write_or_remove_forms(known, std::nullopt, in_utm, "s.ply", said);
  CHECK(said.str().empty());
  CHECK(directory.count_files() == 0);
}

}  // namespace globalmatch::support::test_transform_forms

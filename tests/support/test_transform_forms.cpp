#include "support/transform_forms.hpp"

#include <nlohmann/json.hpp>

#include <sstream>
#include <string>
#include <vector>

#include "catch.hpp"
#include "file_checks.hpp"
#include "support/pdal_pipelines.hpp"
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

TEST_CASE("poses in headers are those that programs apply before the transform, to source and target") {
  const temporary_directory directory;
  const header_poses poses{
      Eigen::Translation3d(500, 300, 10) * Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()),
      Eigen::Translation3d(-20, 7, 1) * Eigen::AngleAxisd(1, Eigen::Vector3d::UnitZ())};
  const std::filesystem::path paths[] = {directory / "t.mat.txt", directory / "t.json", directory / "t.dat"};
  std::ostringstream said;
  write_or_remove_forms(paths, a_transform(), {1, 2, 3}, "s.ptx", said, poses);
  CHECK(said.str().find("apply the poses in the headers") != std::string::npos);
  const Eigen::Isometry3d survey_from_source = poses.target * a_transform();
  CHECK((read_transform(paths[0]) * poses.source).isApprox(survey_from_source, 1e-12));
  CHECK(read_transform(paths[2]).isApprox(survey_from_source, 1e-12));
  const auto pipeline = nlohmann::json::parse(bytes_of(paths[1]));
  const auto matrix = directory.file("pdal.txt", pipeline[1]["matrix"].get<std::string>());
  CHECK(read_transform(matrix).isApprox(read_transform(paths[0]), 1e-12));
  std::ostringstream without;
  write_or_remove_forms(paths, a_transform(), {1, 2, 3}, "s.ptx", without);
  CHECK(without.str().find("headers") == std::string::npos);
}

TEST_CASE("a transform for CloudCompare is centred near the source as loaded with its pose") {
  const temporary_directory directory;
  const header_poses poses{Eigen::Isometry3d(Eigen::Translation3d(in_utm))};
  const std::string line =
      write_transform_form(directory / "t.mat.txt", a_transform(), {1, 2, 3}, "s.e57", poses);
  CHECK(line.find("-GLOBAL_SHIFT -691200 -5334600 -500") != std::string::npos);
}

TEST_CASE("no command is printed for one scan of several, standard input or a folder") {
  const temporary_directory directory;
  for (const std::filesystem::path& source : {std::filesystem::path("s.ptx#2"), std::filesystem::path("-"),
                                              std::filesystem::path(directory / ".")}) {
    const std::string line = write_transform_form(directory / "t.mat.txt", a_transform(), {1, 2, 3}, source);
    CHECK(line.find("-SILENT") == std::string::npos);
    CHECK(line.find("select it alone") != std::string::npos);
    const std::vector<std::filesystem::path> pipeline = {directory / "t.json"};
    require_error(
        pipeline[0], [&](const auto&) { require_forms(pipeline, source, "t.ply"); }, source.string().c_str(),
        "");
  }
}

TEST_CASE("where single precision does not hold the target, that is said") {
  const temporary_directory directory;
  const std::filesystem::path paths[] = {directory / "t.mat.txt"};
  std::ostringstream said, near;
  write_or_remove_forms(paths, Eigen::Translation3d(in_utm) * a_transform(), {1, 2, 3}, "s.las", said);
  CHECK(said.str().find("rounds coordinates to 0.5 m") != std::string::npos);
  write_or_remove_forms(paths, Eigen::Isometry3d(Eigen::Translation3d(3, 4, 5)), in_utm, "s.las", near);
  CHECK(near.str().find("rounds") == std::string::npos);
}

TEST_CASE("pipelines for PDAL keep the precision of coordinates") {
  const auto writer = [](const char* source) {
    return nlohmann::json::parse(pdal_pipeline(source, a_transform().matrix()))[2];
  };
  CHECK(writer("s.ply")["storage_mode"] == "little endian");
  CHECK(writer("s.CSV")["precision"] == 6);
  CHECK(writer("s.CSV")["filename"] == "s_registered.CSV");
  CHECK(writer("s.laz").contains("scale_x") == false);
  for (const char* source : {"s.pcd", "s.e57", "s.ptx", "s.pts", "s"}) {
    CHECK(writer(source)["filename"] == "s_registered.laz");
    CHECK(writer(source)["scale_x"] == 1e-4);
  }
}

TEST_CASE("text is for PDAL only where its first line names coordinates as PDAL reads it") {
  const temporary_directory directory;
  const std::vector<std::filesystem::path> pipeline = {directory / "t.json"};
  for (const char* text : {"x,y,z,radius\n1,2,3,4\n", "X Y Z\n1 2 3\n", "id;X;Y;Z\n1;2;3;4\n"})
    CHECK_NOTHROW(require_forms(pipeline, directory.file("s.txt", text), "t.ply"));
  for (const char* text :
       {"1 2 3\n4 5 6\n", "//X Y Z\n1 2 3\n", "easting,northing,height\n1,2,3\n", "3\n1 2 3\n"})
    require_error(
        pipeline[0], [&](const auto&) { require_forms(pipeline, directory.file("s.xyz", text), "t.ply"); },
        "first line PDAL takes for a header", "choose --write");
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

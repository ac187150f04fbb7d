// What register_survey writes when it is asked to: placed scans, all of them in one file, a record of the
// run.
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "catch.hpp"
#include "programs/program_run.hpp"
#include "programs/written_surveys.hpp"
#include "support/scan_files.hpp"
#include "support/transform_files.hpp"

namespace globalmatch::support::test_survey_outputs {

using Catch::Matchers::Contains;

TEST_CASE("register_survey --json records results, inputs, options and build, on exit 0 and 1") {
  const temporary_directory directory;
  write_stand(directory, 3);
  directory.file("few.csv", "x,y,z\n1,2,0\n3,4,0\n");
  const auto record = [&] { return nlohmann::json::parse(bytes_of(directory / "run.json")); };
  const std::string maps = "--stem-maps s1.csv s2.csv s3.csv --json run.json --out-dir ";
  REQUIRE(call(directory, "register_survey", maps + "out --threads 2").status == 0);
  const auto placed = record();
  CHECK(placed["all_placed"] == true);
  CHECK(placed["scans"].size() == 3);
  CHECK(placed["components"] == 1);
  CHECK(placed["seconds"].get<double>() > 0);
  CHECK(placed["stages"].contains("overlaps"));
  CHECK(placed["globalmatch"]["version"].is_string());
  for (const char* key : {"commit", "compiler", "processor"}) CHECK(placed["globalmatch"].contains(key));
  CHECK(placed["command"].size() == 11);
  CHECK(placed["options"]["threads"] == "2");
  CHECK(placed["options"]["min-quality"].is_string());
  REQUIRE(placed["inputs"].size() == 3);
  for (const auto& input : placed["inputs"]) {
    CHECK(input["bytes"] == std::filesystem::file_size(directory / input["path"].get<std::string>()));
    CHECK(input["hash"].get<std::string>().size() == 16);
  }
  CHECK(placed["warnings"].is_array());
  const auto whole = nlohmann::json::parse(bytes_of(directory / "out/survey.json"));
  for (const auto& [key, value] : whole.items()) CHECK(placed[key] == value);

  REQUIRE(call(directory, "register_survey", maps + "out few.csv").status == 2);  // scans beside stem maps
  CHECK(record() == placed);
  REQUIRE(call(directory, "register_survey",
               "--stem-maps s1.csv s2.csv s3.csv few.csv absent.csv --json run.json --out-dir out")
              .status == 1);
  CHECK(record()["all_placed"] == false);
  CHECK(record()["scans"].size() == 5);
  REQUIRE(call(directory, "register_survey", maps + "out --only match --part 1/2").status == 0);
  CHECK(record()["inputs"].size() == 3);
  CHECK_FALSE(record().contains("components"));
}

#ifdef GLOBALMATCH_HAS_SIMULATOR
namespace {

std::vector<Eigen::Vector3d> points_of(const std::filesystem::path& file) {
  const scan_file scan = open_scan(file);
  return {scan.begin(), scan.end()};
}

}  // namespace

TEST_CASE(
    "register_survey --write puts each placed scan into the survey's frame, --merge one point a voxel") {
  const temporary_directory directory;
  REQUIRE(call(directory, "simulate_plot", "scans --stations 3 --angular-step 0.3 --seed 5").status == 0);
  REQUIRE(call(directory, "register_survey",
               "scans --out-dir out --write placed --merge merged.ply --voxel 0.1 --threads 1")
              .status == 0);
  constexpr double voxel = 0.1;
  std::set<std::array<double, 3>> voxels, merged_voxels;
  const auto voxel_of = [&](const Eigen::Vector3d& p) {
    return std::array{std::floor(p.x() / voxel), std::floor(p.y() / voxel), std::floor(p.z() / voxel)};
  };
  for (const std::string name : {"scan_1", "scan_2", "scan_3"}) {
    const auto before = points_of(directory / ("scans/" + name + ".ply")),
               after = points_of(directory / ("placed/" + name + ".ply"));
    const Eigen::Isometry3d pose = read_transform(directory / ("out/T_" + name + ".txt"));
    REQUIRE(before.size() == after.size());
    double largest = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      largest = std::max(largest, (pose * before[i] - after[i]).norm());
      voxels.insert(voxel_of(after[i]));
    }
    CHECK(largest < 1e-9);
  }
  const auto merged = points_of(directory / "merged.ply");
  for (const Eigen::Vector3d& p : merged) CHECK(merged_voxels.insert(voxel_of(p)).second);
  CHECK(merged_voxels == voxels);

  const std::string known = bytes_of(directory / "merged.ply");
  REQUIRE(
      call(directory, "register_survey",
           "scans/scan_3.ply scans/scan_1.ply scans/scan_2.ply --out-dir out --merge merged.ply --voxel 0.1 "
           "--write placed --write-as laz --threads 3")
          .status == 0);
  CHECK(bytes_of(directory / "merged.ply") == known);
  CHECK_THAT(open_scan(directory / "placed/scan_2.laz").header().format, Contains("LAZ"));
}

TEST_CASE("register_survey --tiles takes folders as scans, and writes them") {
  const temporary_directory directory;
  REQUIRE(call(directory, "simulate_plot", "scans --stations 2 --angular-step 0.3 --seed 5").status == 0);
  for (const std::string name : {"1", "2"}) {
    std::filesystem::create_directory(directory / ("plot" + name));
    std::filesystem::rename(directory / ("scans/scan_" + name + ".ply"),
                            directory / ("plot" + name + "/all.ply"));
  }
  REQUIRE(call(directory, "register_survey", "plot1 plot2 --tiles --out-dir out --write placed").status == 0);
  CHECK_THAT(row_of(directory / "out/poses.csv", "plot2"), Contains("plot2,placed,0,"));
  CHECK(points_of(directory / "placed/plot1.ply").size() == points_of(directory / "plot1/all.ply").size());
}

namespace {

/// A PTX file of scans, whose poses are the identity.
void write_ptx(const std::filesystem::path& path, const std::vector<std::filesystem::path>& scans) {
  std::ofstream out(path);
  for (const auto& scan : scans) {
    const auto points = points_of(scan);
    out << points.size() << "\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    for (const Eigen::Vector3d& p : points) out << p.x() << ' ' << p.y() << ' ' << p.z() << " 0.5\n";
  }
}

}  // namespace

TEST_CASE("register_survey --posed copies files of scans with their poses, and names scans without place") {
  const temporary_directory directory;
  REQUIRE(call(directory, "simulate_plot", "scans --stations 3 --angular-step 0.3 --seed 5").status == 0);
  const auto scan = [&](int k) { return directory / ("scans/scan_" + std::to_string(k) + ".ply"); };
  const auto few_points = directory.file("few.xyz", "1 2 3\n4 5 6\n7 8 9\n");
  write_ptx(directory / "plot.ptx", {scan(1), few_points, scan(2)});
  write_ptx(directory / "few.ptx", {few_points});
  const auto run = call(directory, "register_survey",
                        "plot.ptx few.ptx scans/scan_3.ply --out-dir out --posed posed --threads 2");
  CAPTURE(run.complaint);
  REQUIRE(run.status == 1);  // of the few points
  for (const std::string number : {"1", "3"}) {
    const auto pose = open_scan((directory / "posed/plot.ptx").string() + '#' + number).header().pose;
    const Eigen::Isometry3d known = read_transform(directory / ("out/T_plot#" + number + ".txt"));
    REQUIRE(pose);
    CHECK(pose->isApprox(known, 1e-12));
  }
  CHECK_THAT(run.complaint, Contains("plot.ptx: scan 2 keeps the pose that it had") &&
                                Contains("few.ptx: scan 1 keeps the pose that it had"));
  CHECK(bytes_of(directory / "posed/few.ptx") == bytes_of(directory / "few.ptx"));

  const std::string known = bytes_of(directory / "plot.ptx");
  std::filesystem::create_directories(directory / "other");
  std::filesystem::create_directories(directory / "links");
  std::filesystem::copy_file(directory / "plot.ptx", directory / "other/plot.ptx");
  std::filesystem::create_symlink("../other/plot.ptx", directory / "links/few.ptx");
  const auto complaint_of = [&](const std::string& arguments) {
    const auto refused = call(directory, "register_survey", "--out-dir refused " + arguments);
    CHECK(refused.status == 2);
    return refused.complaint;
  };
  CHECK_THAT(complaint_of("plot.ptx --posed ."), Contains("is one of the scans"));
  CHECK_THAT(complaint_of("few.ptx other/plot.ptx --posed links"), Contains("is one of the scans"));
  CHECK_THAT(complaint_of("scans --posed posed"), Contains("no scan is of an E57 or PTX file"));
  CHECK_THAT(complaint_of("plot.ptx other/plot.ptx --posed posed"), Contains("the copy of both"));
  CHECK_THAT(complaint_of("plot.ptx --posed few.xyz"), Contains("few.xyz"));
  CHECK_FALSE(std::filesystem::exists(directory / "refused"));
  CHECK(bytes_of(directory / "plot.ptx") == known);
  CHECK(bytes_of(directory / "other/plot.ptx") == known);
}

TEST_CASE("register_survey replaces no scan by what it writes, and refuses what it cannot write") {
  const temporary_directory directory;
  REQUIRE(call(directory, "simulate_plot", "scans --stations 2 --angular-step 0.4 --seed 5").status == 0);
  const std::string known = bytes_of(directory / "scans/scan_1.ply");
  for (const char* wrong : {"--write scans", "--merge scans/scan_1.ply", "--merge merged.xyz", "--voxel 0.1",
                            "--merge merged.ply --voxel 0", "--write-as las", "--write x --write-as e57"}) {
    CAPTURE(wrong);
    CHECK(call(directory, "register_survey", std::string("scans --out-dir out ") + wrong).status == 2);
  }
  CHECK(bytes_of(directory / "scans/scan_1.ply") == known);
}
#endif

}  // namespace globalmatch::support::test_survey_outputs

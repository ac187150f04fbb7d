// The contract of register_survey: statuses, files, what is kept and what is not done again.
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "programs/program_run.hpp"
#include "programs/written_surveys.hpp"
#include "support/stem_files.hpp"
#include "support/transform_files.hpp"

namespace globalmatch::support::test_survey_programs {

using Catch::Matchers::Contains;

TEST_CASE("register_survey places stem maps, and writes poses, matrices, links and trees") {
  const temporary_directory directory;
  const auto poses = write_three(directory);
  REQUIRE(
      call(directory, "register_survey", "--stem-maps s1.csv s2.csv s3.csv --out-dir out --report plan.svg")
          .status == 0);
  CHECK_THAT(bytes_of(directory / "plan.svg"),
             Contains("3 of 3 scans placed") && Contains(">s2</text>") && Contains("</svg>"));
  const auto report = nlohmann::json::parse(bytes_of(directory / "out/survey.json"));
  CHECK(report["components"] == 1);
  const auto reference = report["reference"].get<std::string>();
  const auto truth = [&](const std::string& name) { return poses[std::size_t(name[1] - '1')]; };
  for (const std::string name : {"s1", "s2", "s3"}) {
    const Eigen::Isometry3d found = read_transform(directory / ("out/T_" + name + ".txt"));
    CHECK((found.translation() - (truth(reference).inverse() * truth(name)).translation()).norm() < 0.03);
    CHECK_THAT(row_of(directory / "out/poses.csv", name), Contains(name + ",placed,0,"));
  }
  CHECK(lines_of(directory / "out/links.csv").size() == 4);
  const auto trees = read_stems(directory / "out/trees.csv");
  CHECK(trees.stems.size() > 150);
  CHECK(trees.has_heights);
}

TEST_CASE("register_survey takes patterns and folders of stem maps, and no standard input") {
  const temporary_directory directory;
  write_three(directory);
  const auto report_of = [&](const std::string& out) {
    return nlohmann::json::parse(bytes_of(directory / (out + "/survey.json")));
  };
  REQUIRE(call(directory, "register_survey", "--stem-maps 's?.csv' --out-dir a").status == 0);
  CHECK(report_of("a")["components"] == 1);
  CHECK(std::filesystem::exists(directory / "a/T_s3.txt"));
  std::filesystem::create_directory(directory / "maps");
  for (const char* name : {"s1.csv", "s2.csv", "s3.csv"})
    std::filesystem::rename(directory / name, directory / "maps" / name);
  REQUIRE(call(directory, "register_survey", "--stem-maps maps --out-dir b").status == 0);
  CHECK(bytes_of(directory / "b/poses.csv") == bytes_of(directory / "a/poses.csv"));
  const auto none = call(directory, "register_survey", "--stem-maps 'x*.csv' --out-dir c");
  CHECK(none.status == 2);
  CHECK_THAT(none.complaint, Contains("matches no file"));
  const auto piped = call(directory, "register_survey", "- --out-dir d");
  CHECK(piped.status == 2);
  CHECK_THAT(piped.complaint, Contains("SCAN -: a survey reads its scans several times"));
}

TEST_CASE("register_survey gives the same bytes whatever the order of its inputs and the number of threads") {
  const temporary_directory directory;
  write_three(directory);
  REQUIRE(
      call(directory, "register_survey", "--stem-maps s1.csv s2.csv s3.csv --out-dir a --threads 1").status ==
      0);
  REQUIRE(
      call(directory, "register_survey", "--stem-maps s3.csv s1.csv s2.csv s1.csv --out-dir b --threads 4")
          .status == 0);
  for (const char* file : {"poses.csv", "links.csv", "trees.csv", "T_s1.txt", "T_s2.txt", "T_s3.txt"}) {
    CAPTURE(file);
    CHECK(bytes_of(directory.path() / "a" / file) == bytes_of(directory.path() / "b" / file));
  }
}

TEST_CASE("register_survey keeps the reference of an earlier run, and the pose of a fixed scan") {
  const temporary_directory directory;
  const auto poses = write_three(directory);
  REQUIRE(call(directory, "register_survey", "--stem-maps s2.csv s3.csv --out-dir out").status == 0);
  const auto before = nlohmann::json::parse(bytes_of(directory / "out/survey.json"))["reference"];
  REQUIRE(call(directory, "register_survey", "--stem-maps s1.csv s2.csv s3.csv --out-dir out").status == 0);
  CHECK(nlohmann::json::parse(bytes_of(directory / "out/survey.json"))["reference"] == before);
  write_transform(directory / "F.txt", poses[0]);
  REQUIRE(call(directory, "register_survey", "--stem-maps s1.csv s2.csv s3.csv --out-dir out --fix s1=F.txt")
              .status == 0);
  CHECK(read_transform(directory / "out/T_s1.txt").isApprox(poses[0], 1e-9));
  CHECK((read_transform(directory / "out/T_s3.txt").translation() - poses[2].translation()).norm() < 0.03);
}

TEST_CASE("register_survey takes several fixed scans, and the frame of priors where there are none") {
  const temporary_directory directory;
  const auto poses = write_three(directory);
  const std::string maps = "--stem-maps s1.csv s2.csv s3.csv --out-dir out";
  write_transform(directory / "F1.txt", poses[0]);
  write_transform(directory / "F3.txt", poses[2]);
  REQUIRE(call(directory, "register_survey", maps + " --fix s1=F1.txt --fix s3=F3.txt").status == 0);
  CHECK(bytes_of(directory / "out/T_s1.txt") == bytes_of(directory / "F1.txt"));
  CHECK(bytes_of(directory / "out/T_s3.txt") == bytes_of(directory / "F3.txt"));
  CHECK((read_transform(directory / "out/T_s2.txt").translation() - poses[1].translation()).norm() < 0.03);

  std::ofstream priors(directory / "priors.csv");
  priors << "scan,x,y,z,yaw_deg,sigma_xy,sigma_z,sigma_yaw_deg\n"
         << "s1," << poses[0](0, 3) + 1000 << ',' << poses[0](1, 3) << ",502.5,,0.1,0.1,\n"
         << "s2,,,,114.59,,,1\n\n"
         << "s3," << poses[2](0, 3) + 1000 << ',' << poses[2](1, 3) << ",,,0.1,,\n"
         << "s9,1,2,3,,1,1,\n";
  priors.close();
  const support::run placed = call(directory, "register_survey", maps + " --priors priors.csv");
  REQUIRE(placed.status == 0);
  CHECK_THAT(placed.complaint, Contains("s9: no scan of that name"));
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Isometry3d found = read_transform(directory / ("out/T_s" + std::to_string(i + 1) + ".txt"));
    CHECK((found.translation() - Eigen::Vector3d(1000, 0, 500) - poses[i].translation()).norm() < 0.05);
  }
}

TEST_CASE("register_survey names priors that disagree, and tables that it does not understand") {
  const temporary_directory directory;
  const auto poses = write_three(directory);
  const auto written = [&](const std::string& table) {
    std::ofstream(directory / "priors.csv") << table;
    return call(directory, "register_survey",
                "--stem-maps s1.csv s2.csv s3.csv --out-dir out --priors priors.csv");
  };
  const support::run off = written("scan,yaw_deg,sigma_yaw_deg\ns1,17.19,1\ns2,114.59,1\ns3,90,1\n");
  CHECK(off.status == 0);
  CHECK_THAT(off.complaint, Contains("s3: its prior is 147 standard deviations off"));
  const support::run undirected = written("scan,x,y,sigma_xy\ns1,431000.5,5621000.5,1\n");
  CHECK(undirected.status == 0);
  CHECK_THAT(undirected.complaint, Contains("do not tell the direction"));
  const auto report = nlohmann::json::parse(bytes_of(directory / "out/survey.json"));
  CHECK(report["frames"][0]["source"] == "priors");
  CHECK(report["frames"][0]["sigma_yaw_deg"].is_null());
  for (const auto& [table, problem] :
       std::vector<std::pair<std::string, std::string>>{{"", "empty"},
                                                        {"name,x,y\n", "has the header"},
                                                        {"x,y,sigma_xy\n", "no column scan"},
                                                        {"scan,x,y,sigma_xy\ns1,1,2,\n", "sigma_xy must be"},
                                                        {"scan,x,y,sigma_xy\ns1,1,,3\n", "both or neither"},
                                                        {"scan,x,y,sigma_xy\ns1,a,2,3\n", "line 2"},
                                                        {"scan,x,y,sigma_xy\ns1,1,2,3,4\n", "more fields"},
                                                        {"scan,x,y,sigma_xy\n,1,2,3\n", "no name"}}) {
    CAPTURE(table);
    const support::run refused = written(table);
    CHECK(refused.status == 2);
    CHECK_THAT(refused.complaint, Contains(problem));
  }
}

TEST_CASE("register_survey names what it cannot place, and does the rest") {
  const temporary_directory directory;
  write_three(directory);
  std::filesystem::copy_file(directory / "s1.csv", directory / "copy.csv");
  write_seen(directory / "alien.csv", stand(2), pose_at(30, 30, 1), 5);
  directory.file("few.csv", "x,y,z\n1,2,0\n3,4,0\n");
  directory.file("none.csv", "x,y,z\n");
  directory.file("bad.csv", "not,a,map\n1,2,3\n");
  std::filesystem::create_directory(directory / "out");
  directory.file("out/T_bad.txt", "old");
  const run result = call(directory, "register_survey",
                          "--stem-maps s1.csv s2.csv s3.csv copy.csv alien.csv few.csv none.csv bad.csv "
                          "absent.csv --out-dir out");
  CHECK(result.status == 1);
  const auto row = [&](const char* name) { return row_of(directory / "out/poses.csv", name); };
  CHECK_THAT(row("s2"), Contains(",placed,0,"));
  CHECK_THAT(row("alien"), Contains(",placed_alone,1,"));
  CHECK_THAT(row("few"), Contains(",unplaced,-1,"));
  CHECK_THAT(row("none"), Contains(",no_stems,-1,"));
  CHECK_THAT(row("bad"), Contains(",unreadable,-1,") && Contains("bad.csv"));
  CHECK_THAT(row("absent"), Contains(",unreadable,-1,"));
  CHECK_THAT(row("s1"), Contains("same as copy"));
  CHECK_THAT(result.complaint, Contains("few: unplaced") && Contains("bad: unreadable"));
  CHECK_FALSE(std::filesystem::exists(directory / "out/T_bad.txt"));
  CHECK_FALSE(std::filesystem::exists(directory / "out/T_few.txt"));
}

TEST_CASE("register_survey without anything readable, or with wrong usage, ends in status 2") {
  const temporary_directory directory;
  write_three(directory);
  CHECK(call(directory, "register_survey", "--out-dir out").status == 2);
  CHECK(call(directory, "register_survey", "--stem-maps absent.csv --out-dir out").status == 2);
  const run named =
      call(directory, "register_survey", "--stem-maps s1.csv s2.csv --out-dir out --fix x=F.txt");
  CHECK(named.status == 2);
  CHECK_THAT(named.complaint, Contains("F.txt"));
  CHECK(call(directory, "register_survey", "--stem-maps s1.csv s2.csv --out-dir out --fix s1").status == 2);
}

#ifdef GLOBALMATCH_HAS_SIMULATOR
TEST_CASE("register_survey maps scans once, and goes on where a run was stopped") {
  const temporary_directory directory;
  REQUIRE(call(directory, "simulate_plot", ". --stations 3 --angular-step 0.2 --seed 5").status == 0);
  REQUIRE(call(directory, "register_survey", "scan_1.ply scan_2.ply --out-dir out --only map").status == 0);
  CHECK_FALSE(std::filesystem::exists(directory / "out/poses.csv"));
  const auto kept = bytes_of(directory / "out/maps/scan_1.gmap");
  std::filesystem::resize_file(directory / "out/maps/scan_2.gmap", 100);  // as if it was cut off
  REQUIRE(call(directory, "register_survey", ". --out-dir out").status == 0);
  CHECK_THAT(bytes_of(directory / "stdout.log"), Contains("scan_1: ") && Contains("mapped before"));
  CHECK(bytes_of(directory / "out/maps/scan_1.gmap") == kept);
  for (const char* part : {"2/2", "1/2"})
    REQUIRE(call(directory, "register_survey", std::string(". --out-dir fresh --only map --part ") + part)
                .status == 0);
  REQUIRE(call(directory, "register_survey", ". --out-dir fresh").status == 0);
  for (const char* file : {"poses.csv", "trees.csv", "maps/scan_2.gmap"})
    CHECK(bytes_of(directory.path() / "out" / file) == bytes_of(directory.path() / "fresh" / file));
  REQUIRE(call(directory, "register_survey", ". --out-dir out --min-quality 0.9").status == 0);
  CHECK(bytes_of(directory / "out/maps/scan_1.gmap") != kept);
}

TEST_CASE("register_survey refines scans by their samples, and no pair twice") {
  const temporary_directory directory;
  REQUIRE(call(directory, "simulate_plot", ". --stations 3 --angular-step 0.2 --seed 6 --slope 10").status ==
          0);
  const auto pose = [&](int scan) {
    return read_transform(directory / ("pose_" + std::to_string(scan) + ".txt"));
  };
  write_transform(directory / "F.txt", pose(1));
  const std::string all = ". --fix scan_1=F.txt --out-dir out";
  const auto error = [&] {
    double largest = 0;
    for (const int scan : {2, 3}) {
      const Eigen::Isometry3d placed =
          read_transform(directory / ("out/T_scan_" + std::to_string(scan) + ".txt"));
      largest = std::max(largest, (placed.translation() - pose(scan).translation()).norm());
    }
    return largest;
  };
  REQUIRE(call(directory, "register_survey", all).status == 0);
  CHECK(error() < 0.003);
  CHECK_THAT(bytes_of(directory / "stdout.log"),
             Contains(" of 3 pairs of scans by their stems, 3 by their ground"));
  CHECK(nlohmann::json::parse(bytes_of(directory / "out/survey.json"))["refinement"]["pairs"] == 3);
  const auto file = [&](int source, int target) {
    return directory /
           ("out/refined/scan_" + std::to_string(source) + "_on_scan_" + std::to_string(target) + ".pair");
  };
  std::vector<std::filesystem::path> pairs;
  for (const int source : {1, 2, 3})
    for (const int target : {1, 2, 3})
      if (std::filesystem::exists(file(source, target))) pairs.push_back(file(source, target));
  REQUIRE(pairs.size() == 3);
  const auto poses = bytes_of(directory / "out/poses.csv"), kept = bytes_of(pairs[0]),
             other = bytes_of(pairs[1]);
  const auto written = std::filesystem::last_write_time(pairs[0]);
  std::filesystem::resize_file(pairs[1], 60);  // as if it was cut off
  REQUIRE(call(directory, "register_survey", all + " --threads 1").status == 0);
  CHECK(std::filesystem::last_write_time(pairs[0]) == written);
  CHECK(bytes_of(pairs[1]) == other);
  CHECK(bytes_of(directory / "out/poses.csv") == poses);
  REQUIRE(call(directory, "register_survey", all + " --icp none").status == 0);
  CHECK(bytes_of(pairs[0]) != kept);
  CHECK_THAT(bytes_of(directory / "stdout.log"),
             Contains("refined 0 of 3 pairs of scans by their stems, 3 by"));
  CHECK(bytes_of(directory / "out/poses.csv") != poses);
}
#endif

}  // namespace globalmatch::support::test_survey_programs

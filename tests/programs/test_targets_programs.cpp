// register_survey with targets, as its user calls it.
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <string>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "programs/program_run.hpp"
#include "programs/written_surveys.hpp"
#include "support/transform_files.hpp"

namespace globalmatch::support::test_targets_programs {

using Catch::Matchers::Contains;

namespace {

/// Two maps each of two stands that are beside each other and have no tree in common.
std::vector<Eigen::Isometry3d> write_two_stands(const temporary_directory& directory) {
  std::vector<Eigen::Isometry3d> poses = {pose_at(25, 25, 0.3), pose_at(40, 30, 2), pose_at(30, 35, -1),
                                          pose_at(45, 40, 1)};
  for (std::size_t i = 0; i < 4; ++i)
    write_seen(directory / ("s" + std::to_string(i + 1) + ".csv"), stand(i < 2 ? 1 : 2), poses[i], i + 10);
  for (std::size_t i = 2; i < 4; ++i) poses[i].pretranslate(Eigen::Vector3d(30, 0, 0));
  return poses;
}

/// A line of the table of targets: a place [m] of the survey, as a scan shows it.
std::string line_of(const std::string& scan, const std::string& target, const Eigen::Isometry3d& pose,
                    const Eigen::Vector3d& place) {
  const Eigen::Vector3d p = pose.inverse() * place;
  return std::to_string(p.z()) + "," + scan + "," + std::to_string(p.x()) + "," + std::to_string(p.y()) +
         "," + target + "\n";
}

const std::string header = "z,scan,x,y,target\n";
const std::string maps = "--stem-maps s1.csv s2.csv s3.csv s4.csv --out-dir out";

}  // namespace

TEST_CASE("register_survey places stands beside each other by targets, and names those that are wrong") {
  const temporary_directory directory;
  const auto poses = write_two_stands(directory);
  const std::vector<Eigen::Vector3d> places = {{48, 20, 3}, {52, 31, 4}, {47, 43, 2}, {55, 50, 6}};
  std::string table = header + "1,s9,2,3,T0\n";
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t t = 0; t < places.size(); ++t)
      table += line_of("s" + std::to_string(i + 1), "T" + std::to_string(t), poses[i],
                       i == 3 && t == 2 ? places[t] + Eigen::Vector3d(0.35, 0, 0) : places[t]);
  CHECK(call(directory, "register_survey", maps).status == 1);
  directory.file("targets.csv", table);
  const run placed = call(directory, "register_survey", maps + " --targets targets.csv");
  CHECK(placed.status == 0);
  CHECK_THAT(placed.complaint, Contains("s9: no scan of that name"));
  CHECK_THAT(placed.complaint, Contains("target T2: s4 has it 0.35"));
  std::vector<Eigen::Isometry3d> found;
  for (std::size_t i = 0; i < 4; ++i)
    found.push_back(read_transform(directory / ("out/T_s" + std::to_string(i + 1) + ".txt")));
  for (std::size_t i = 1; i < 4; ++i)
    CHECK(((found[0].inverse() * found[i]).translation() - (poses[0].inverse() * poses[i]).translation())
              .norm() < 0.01);
  const auto report = nlohmann::json::parse(bytes_of(directory / "out/survey.json"));
  REQUIRE(report["targets"].size() == 4);
  CHECK(report["targets"][2]["target"] == "T2");
  CHECK(report["targets"][2]["seen"].size() == 4);
  CHECK(report["targets"][2]["seen"][3]["weight"] == 0);
  CHECK(report["targets"][1]["seen"][0]["weight"] > 0.5);
  const std::string links = bytes_of(directory / "out/links.csv");
  CHECK_THAT(links, Contains("used,targets\n"));
  CHECK_THAT(links, Contains(",1,4\n"));

  REQUIRE(call(directory, "register_survey", maps + " --only match").status == 0);
  const std::string matches = bytes_of(directory / "out/matches/part_1_of_1.gmatch");
  REQUIRE(call(directory, "register_survey", maps + " --targets targets.csv --only match").status == 0);
  CHECK(bytes_of(directory / "out/matches/part_1_of_1.gmatch") == matches);
}

TEST_CASE("a target that two scans have at different places is named with both") {
  const temporary_directory directory;
  const auto poses = write_two_stands(directory);
  directory.file("targets.csv", header + line_of("s1", "T", poses[0], {30, 30, 2}) +
                                    line_of("s2", "T", poses[1], {30, 30.5, 2}) +
                                    line_of("s3", "T", poses[2], {70, 30, 2}));
  const run placed = call(directory, "register_survey", maps + " --targets targets.csv");
  CHECK(placed.status == 1);  // one target links no stands
  CHECK_THAT(placed.complaint, Contains("target T: s") && Contains(" have it 0.") && Contains("m apart"));
}

TEST_CASE("register_survey refuses tables of targets that make no sense") {
  const temporary_directory directory;
  write_two_stands(directory);
  for (const auto& [table, problem] : std::vector<std::pair<std::string, std::string>>{
           {"scan,target,x,y\ns1,T1,1,2\n", "x, y and z"},
           {"scan,target,x,y,z\ns1,T1,1,2,\n", "x, y and z"},
           {"scan,target,x,y,z\ns1,,1,2,3\n", "the target has no name"},
           {"scan,target,x,y,z\ns1,T1,1,2,3\ns1,T1,1,2,4\n", "line 3"},
           {"scan,target,x,y,z,sigma\ns1,T1,1,2,3,0\n", "sigma must be"},
           {"target,x,y,z\n", "no column scan"}}) {
    CAPTURE(table);
    directory.file("targets.csv", table);
    const run refused = call(directory, "register_survey", maps + " --targets targets.csv");
    CHECK(refused.status == 2);
    CHECK_THAT(refused.complaint, Contains(problem));
  }
}

}  // namespace globalmatch::support::test_targets_programs

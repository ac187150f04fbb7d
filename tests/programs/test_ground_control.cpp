// What is known of a survey besides its scans: trees with known positions, verticals, and names that must
// fit.
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "catch.hpp"
#include "programs/program_run.hpp"
#include "programs/written_surveys.hpp"
#include "support/stem_files.hpp"
#include "support/transform_files.hpp"

namespace globalmatch::support::test_ground_control {

using Catch::Matchers::Contains;

namespace {

const Eigen::Vector3d grid_origin(431000.25, 5621000.5, 312);  // [m] of the stand, in a national grid

/// Trees of a stand in the grid, to 1 cm, in which distances are so many times those of the stand.
void write_control(const std::filesystem::path& file, std::vector<stem_record> trees, double scale = 1) {
  random_source random(99);
  for (stem_record& t : trees) {
    t.x = grid_origin.x() + scale * t.x + 0.01 * random.normal();
    t.y = grid_origin.y() + scale * t.y + 0.01 * random.normal();
    t.z += grid_origin.z();
  }
  write_stems(file, trees);
}

nlohmann::json report_of(const temporary_directory& directory) {
  return nlohmann::json::parse(bytes_of(directory / "out/survey.json"));
}

/// Distance [m] of a scan from where the truth has it in the grid.
double error_in_grid(const temporary_directory& directory, std::size_t scan,
                     const std::vector<Eigen::Isometry3d>& poses) {
  const Eigen::Isometry3d found = read_transform(directory / ("out/T_s" + std::to_string(scan + 1) + ".txt"));
  return (found.translation() - grid_origin - poses[scan].translation()).norm();
}

/// Whether column `scans` of a line of trees.csv is this name, or begins or ends with it.
bool names_scan(const std::string& line, const std::string& name) {
  const std::string scans = " " + line.substr(line.rfind(',') + 1) + " ";
  return scans.find(" " + name + " ") != std::string::npos;
}

const std::string three_maps = "--stem-maps s1.csv s2.csv s3.csv --out-dir out";

}  // namespace

TEST_CASE("register_survey --control places scans in the frame of the control, which is no scan") {
  const temporary_directory directory;
  const auto poses = write_three(directory);
  write_control(directory / "trees.csv", stand(1));
  const std::string all = three_maps + " --control trees.csv";
  const run placed = call(directory, "register_survey", all + " --report plan.svg --json run.json");
  REQUIRE(placed.status == 0);
  CHECK(placed.complaint.empty());
  for (std::size_t scan = 0; scan < 3; ++scan) CHECK(error_in_grid(directory, scan, poses) < 0.01);
  CHECK(lines_of(directory / "out/poses.csv").size() == 4);
  CHECK_FALSE(std::filesystem::exists(directory / "out/T_control.txt"));
  CHECK_THAT(bytes_of(directory / "out/links.csv"), Contains(",control,"));
  CHECK_THAT(bytes_of(directory / "plan.svg"), !Contains(">control<") && !Contains("-5"));
  const auto report = report_of(directory);
  CHECK(report["components"] == 1);
  CHECK(report["frames"][0]["source"] == "fixed");
  CHECK(report["control"]["links"] == 3);
  CHECK(std::abs(report["control"]["scale"].get<double>() - 1) < 3e-4);
  CHECK(report["control"]["sigma"].get<double>() < 2e-4);
  const auto inputs = nlohmann::json::parse(bytes_of(directory / "run.json"))["inputs"];
  REQUIRE(inputs.size() == 4);
  CHECK(inputs[3]["path"] == "trees.csv");
  std::size_t with_control = 0;
  const auto trees = lines_of(directory / "out/trees.csv");
  for (std::size_t i = 1; i < trees.size(); ++i) {
    with_control += names_scan(trees[i], "control");
    CHECK((names_scan(trees[i], "s1") || names_scan(trees[i], "s2") || names_scan(trees[i], "s3")));
  }
  CHECK(report["control"]["trees"] == with_control);

  const auto results = results_in(directory / "out");
  for (const char* stage : {"--only match --part 1/3", "--only match --part 2/3", "--only match --part 3/3",
                            "--only solve --threads 4"})
    REQUIRE(call(directory, "register_survey",
                 "--stem-maps s3.csv s1.csv s2.csv --out-dir parts --control trees.csv " + std::string(stage))
                .status == 0);
  CHECK(results_in(directory / "parts") == results);
}

TEST_CASE("scans without overlap are in one frame where the control holds the trees of both") {
  const temporary_directory directory;
  auto trees = stand(1);
  const std::vector<Eigen::Isometry3d> poses = {pose_at(25, 25, 0.3), pose_at(150, 40, 2)};
  for (const stem_record& t : stand(3)) trees.push_back({t.x + 110, t.y, t.z, t.radius});
  for (std::size_t i = 0; i < 2; ++i)
    write_seen(directory / ("s" + std::to_string(i + 1) + ".csv"), trees, poses[i], i + 10);
  write_control(directory / "trees.csv", trees);
  const std::string maps = "--stem-maps s1.csv s2.csv --out-dir out";
  CHECK(call(directory, "register_survey", maps).status == 1);
  REQUIRE(call(directory, "register_survey", maps + " --control trees.csv").status == 0);
  for (std::size_t scan = 0; scan < 2; ++scan) CHECK(error_in_grid(directory, scan, poses) < 0.015);
}

TEST_CASE("a control of which nothing is recognised, or without heights, is said to be so") {
  const temporary_directory directory;
  const auto poses = write_three(directory);
  write_control(directory / "trees.csv", stand(8));
  const run elsewhere = call(directory, "register_survey", three_maps + " --control trees.csv");
  CHECK(elsewhere.status == 0);
  CHECK_THAT(elsewhere.complaint, Contains("control: none of its trees was recognised"));
  CHECK(report_of(directory)["components"] == 1);
  CHECK(report_of(directory)["frames"].size() == 1);
  CHECK(report_of(directory)["control"]["scale"].is_null());
  CHECK_THAT(bytes_of(directory / "out/trees.csv"), !Contains("control"));

  auto flat = stand(1);
  for (stem_record& t : flat) t.z = -grid_origin.z();
  write_control(directory / "trees.csv", flat);
  const run without = call(directory, "register_survey", three_maps + " --control trees.csv");
  CHECK(without.status == 0);
  CHECK_THAT(without.complaint, Contains("control: the heights of its trees are not known"));
  for (std::size_t scan = 0; scan < 3; ++scan) {
    const Eigen::Vector3d found =
        read_transform(directory / ("out/T_s" + std::to_string(scan + 1) + ".txt")).translation();
    CHECK((found - grid_origin - poses[scan].translation()).head<2>().norm() < 0.01);
  }
}

TEST_CASE("the scale of a control that is in a map projection is reported with its sigma, and not applied") {
  const temporary_directory directory;
  const auto poses = write_three(directory);
  write_control(directory / "trees.csv", stand(1), 0.999);
  const run scaled = call(directory, "register_survey", three_maps + " --control trees.csv");
  REQUIRE(scaled.status == 0);
  CHECK_THAT(scaled.complaint, Contains("control: distances in the control are 0.99"));
  const auto control = report_of(directory)["control"];
  const double sigma = control["sigma"];
  CHECK(sigma < 2e-4);
  CHECK(std::abs(control["scale"].get<double>() - 0.999) < 3 * sigma);
  const auto place = [&](int scan) {
    return read_transform(directory / ("out/T_s" + std::to_string(scan) + ".txt"));
  };
  CHECK(place(1).linear().isUnitary(1e-12));
}

TEST_CASE("fixed scans that agree with the control are held, and what fewer agree with is left out") {
  const temporary_directory directory;
  const auto poses = write_three(directory);
  write_control(directory / "trees.csv", stand(1));
  const Eigen::Isometry3d in_grid(Eigen::Translation3d{grid_origin}),
      elsewhere(Eigen::Translation3d(grid_origin + Eigen::Vector3d(2, 0, 0)));
  write_transform(directory / "F1.txt", in_grid * poses[0]);
  write_transform(directory / "W1.txt", elsewhere * poses[0]);
  write_transform(directory / "W3.txt", elsewhere * poses[2]);
  const std::string all = three_maps + " --control trees.csv";
  const run held = call(directory, "register_survey", all + " --fix s1=F1.txt");
  CHECK(held.status == 0);
  CHECK(held.complaint.empty());
  CHECK(bytes_of(directory / "out/T_s1.txt") == bytes_of(directory / "F1.txt"));
  CHECK(error_in_grid(directory, 2, poses) < 0.01);

  const run against_both = call(directory, "register_survey", all + " --fix s1=F1.txt --fix s3=W3.txt");
  CHECK_THAT(against_both.complaint, Contains("s3: its fixed pose is ") && !Contains("control"));
  CHECK(error_in_grid(directory, 2, poses) < 0.01);

  const run outvoted = call(directory, "register_survey", all + " --fix s1=W1.txt --fix s3=W3.txt");
  CHECK_THAT(outvoted.complaint, Contains("control: its frame is ") && !Contains("s1: "));
  CHECK(bytes_of(directory / "out/T_s1.txt") == bytes_of(directory / "W1.txt"));
}

TEST_CASE("controls that cannot serve are refused before anything is mapped") {
  const temporary_directory directory;
  write_three(directory);
  std::filesystem::copy_file(directory / "s1.csv", directory / "control.csv");
  directory.file("two.csv", "x,y\n1,2\n3,4\n");
  directory.file("bad.csv", "a,b\n1,2\n");
  for (const auto& [arguments, problem] : std::vector<std::pair<std::string, std::string>>{
           {three_maps + " --control absent.csv", "absent.csv"},
           {three_maps + " --control two.csv", "has 2 trees"},
           {three_maps + " --control bad.csv", "bad.csv"},
           {"--stem-maps control.csv s2.csv --out-dir out --control s3.csv", "Rename the scan"}}) {
    CAPTURE(arguments);
    const run refused = call(directory, "register_survey", arguments);
    CHECK(refused.status == 2);
    CHECK_THAT(refused.complaint, Contains(problem));
    CHECK_FALSE(std::filesystem::exists(directory / "out"));
  }
}

TEST_CASE(
    "scans that are fixed or levelled by a name that there is not are refused at once, with a near one") {
  const temporary_directory directory;
  const auto poses = write_three(directory);
  write_transform(directory / "F.txt", poses[0]);
  for (const auto& [option, problem] :
       std::vector<std::pair<std::string, std::string>>{{"--fix s11=F.txt", "is it s1?"},
                                                        {"--fix plot=F.txt", "there are s1, s2, s3"},
                                                        {"--fix s1=F.txt --fix s1=F.txt", "given twice"},
                                                        {"--level S2,0.1", "is it s2?"},
                                                        {"--level s2,0.1 --level s2,0.3", "given twice"},
                                                        {"--level s2", "NAME,SIGMA_DEG"},
                                                        {"--level s2,0", "NAME,SIGMA_DEG"},
                                                        {"--level s2,nan", "NAME,SIGMA_DEG"}}) {
    CAPTURE(option);
    const run refused = call(directory, "register_survey", three_maps + " " + option);
    CHECK(refused.status == 2);
    CHECK_THAT(refused.complaint, Contains(problem));
    CHECK_FALSE(std::filesystem::exists(directory / "out"));
  }
}

TEST_CASE("register_survey --level turns the others upright, and says where a level contradicts") {
  const temporary_directory directory;
  const auto trees = stand(1);
  const std::vector<Eigen::Isometry3d> poses = {pose_at(25, 25, 0.3), pose_at(40, 30, 2), pose_at(35, 45, -1),
                                                pose_at(25, 40, 0.5)};
  const Eigen::Isometry3d lean(
      Eigen::AngleAxisd(std::numbers::pi / 60, Eigen::Vector3d(1, 2, 0).normalized()));
  for (std::size_t i = 0; i < 4; ++i)  // all but the first one lean alike
    write_seen(directory / ("s" + std::to_string(i + 1) + ".csv"), trees,
               i == 0 ? poses[i]
                      : poses[i] * Eigen::Isometry3d(poses[i].linear().transpose()) * lean *
                            Eigen::Isometry3d(poses[i].linear()),
               i + 10);
  const std::string maps = "--stem-maps s1.csv s2.csv s3.csv s4.csv --out-dir ";
  const auto up = [&](const std::string& file) { return read_transform(directory / file)(2, 2); };
  REQUIRE(call(directory, "register_survey", maps + "level --level s1,0.1").status == 0);
  CHECK(read_transform(directory / "level/T_s1.txt").isApprox(Eigen::Isometry3d::Identity(), 1e-12));
  for (const char* name : {"s2", "s3", "s4"})
    CHECK(std::acos(up("level/T_" + std::string(name) + ".txt")) * 180 / std::numbers::pi ==
          Approx(3).margin(0.1));
  const run both = call(directory, "register_survey", maps + "both --level s1,0.1 --level s2,0.1");
  CHECK(both.status == 0);
  CHECK_THAT(both.complaint,
             Contains("s1: its vertical is 1.5 degrees") && Contains("s2: its vertical is 1.5 degrees"));
}

#ifdef GLOBALMATCH_HAS_SIMULATOR
namespace {

/// How a simulated scan was placed beside where it is: in the frame of the plot, or beside the first scan.
Eigen::Isometry3d error_of(const temporary_directory& directory, int scan, bool is_beside_first) {
  const auto truth = [&](int k) {
    return read_transform(directory / ("scans/pose_" + std::to_string(k) + ".txt"));
  };
  const auto found = [&](int k) {
    return read_transform(directory / ("out/T_scan_" + std::to_string(k) + ".txt"));
  };
  if (!is_beside_first) return truth(scan).inverse() * found(scan);
  return (truth(1).inverse() * truth(scan)).inverse() * (found(1).inverse() * found(scan));
}

}  // namespace

TEST_CASE("scans are refined in the frame of the control, which has no samples") {
  const temporary_directory directory;
  REQUIRE(
      call(directory, "simulate_plot", "scans --stations 3 --angular-step 0.2 --seed 6 --slope 10").status ==
      0);
  std::filesystem::create_directory(directory / "placed");
  directory.file("placed/scan_2.laz", "old");
  const run placed =
      call(directory, "register_survey", "scans --control scans/stems.csv --out-dir out --write placed");
  REQUIRE(placed.status == 0);
  CHECK_THAT(placed.complaint, Contains("scan_2.laz is of an earlier run") && !Contains("scan_1"));
  CHECK_THAT(bytes_of(directory / "stdout.log"), Contains(" of 3 pairs of scans by their stems"));
  CHECK(bytes_of(directory / "placed/scan_2.laz") == "old");
  CHECK_FALSE(std::filesystem::exists(directory / "placed/control.ply"));
  CHECK_FALSE(std::filesystem::exists(directory / "out/maps/control.gmap"));
  for (const int scan : {1, 2, 3}) {
    const Eigen::Isometry3d off = error_of(directory, scan, false), beside = error_of(directory, scan, true);
    CHECK(off.translation().head<2>().norm() < 0.002);
    CHECK(std::abs(off.translation().z()) < 0.015);
    CHECK(beside.translation().norm() < 0.002);
  }
}

TEST_CASE("tilted scans are refined beside the control as well as without it") {
  const temporary_directory directory;
  REQUIRE(
      call(directory, "simulate_plot", "scans --stations 3 --angular-step 0.2 --seed 6 --slope 10 --tilt 3")
          .status == 0);
  REQUIRE(call(directory, "register_survey", "scans --control scans/stems.csv --out-dir out").status == 0);
  for (const int scan : {2, 3}) {
    const Eigen::Isometry3d beside = error_of(directory, scan, true);
    CHECK(beside.translation().norm() < 0.002);
    CHECK(Eigen::AngleAxisd(beside.linear()).angle() < 2e-4);
  }
}
#endif

}  // namespace globalmatch::support::test_ground_control

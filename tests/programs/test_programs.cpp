// The contract of the example programs: exit statuses, files written, files left alone.
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <string>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "programs/program_run.hpp"
#include "support/build_record.hpp"
#include "support/scan_files.hpp"
#include "support/stem_files.hpp"
#include "support/temporary_directory.hpp"
#include "support/transform_files.hpp"

namespace globalmatch::support::test_programs {

using namespace detail;

namespace {

/// Twelve stems without symmetry, and the same seen from a scanner 3 m further and turned.
std::string stem_csv(double yaw, double shift) {
  std::ostringstream csv;
  csv << "x,y,z\n";
  const double at[12][3] = {{0, 0, 0},     {3.1, 0.4, .2}, {6.7, 1, .1},    {1.2, 4.4, 0},
                            {5.3, 5.9, 1}, {9.1, 3.3, .7}, {2.2, 8.8, .3},  {7.7, 9.4, .2},
                            {12, 7.1, 1},  {4.6, 12.3, 1}, {10.9, 12, 1.2}, {13.5, 1.9, 2}};
  for (const auto& p : at) {
    const Eigen::Vector2d q =
        Eigen::Rotation2Dd(yaw) * Eigen::Vector2d(p[0], p[1]) + Eigen::Vector2d(shift, 0);
    csv << q.x() << ',' << q.y() << ',' << p[2] << '\n';
  }
  return csv.str();
}

/// The record of a run in JSON: build, command, options and inputs.
void check_record(const temporary_directory& directory, const nlohmann::json& report,
                  const std::vector<std::string>& inputs) {
  CHECK(report["globalmatch"]["version"].is_string());
  CHECK(report["command"].size() > inputs.size());
  CHECK(report["options"].contains("threads"));
  CHECK(report["seconds"].is_number());
  CHECK(report["stages"].is_object());
  REQUIRE(report["inputs"].size() == inputs.size());
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    CHECK(report["inputs"][i]["path"] == inputs[i]);
    CHECK(report["inputs"][i]["bytes"] == std::filesystem::file_size(directory / inputs[i]));
    CHECK(report["inputs"][i]["hash"].get<std::string>().size() == 16);
  }
}

}  // namespace

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

TEST_CASE("each program says which version it is, and does nothing else") {
  const temporary_directory directory;
  for (const std::string program : {"scan_info", "map_stems", "match_stems", "register_scans",
                                    "register_survey", "evaluate_registration"}) {
    INFO(program);
    const run asked = call(directory, program, "--version");
    CHECK(asked.status == 0);
    CHECK(asked.complaint.empty());
    CHECK_THAT(bytes_of(directory / "stdout.log"),
               StartsWith(program + " of globalmatch " + this_build().version + ", "));
  }
}

TEST_CASE("match_stems writes the matrix from source to target and ends in status 0") {
  const temporary_directory directory;
  directory.file("source.csv", stem_csv(0, 0));
  directory.file("target.csv", stem_csv(0.7, 3));
  REQUIRE(call(directory, "match_stems", "source.csv target.csv --out T.txt --json r.json").status == 0);
  const Eigen::Isometry3d t = read_transform(directory / "T.txt");
  CHECK((t.translation() - Eigen::Vector3d(3, 0, 0)).norm() < 1e-4);
  CHECK(Eigen::Rotation2Dd(t.linear().topLeftCorner<2, 2>()).angle() == Approx(0.7).margin(1e-5));
  const auto report = nlohmann::json::parse(bytes_of(directory / "r.json"));
  CHECK(report["outcome"] == "registered");
  CHECK(report["matches"] == 12);
  CHECK(report["target_from_source"].size() == 16);
  check_record(directory, report, {"source.csv", "target.csv"});
}

TEST_CASE("match_stems reads radii and says that they resolved the ambiguity of a plantation") {
  random_source random(1);
  std::vector<stem_record> source, target, without_radii;
  for (int column = 0; column < 9; ++column)
    for (int row = 0; row < 8; ++row) {
      const double radius = 0.15 + 0.02 * random.normal();
      const auto seen = [&](double shift) {
        const auto noise = [&] { return 0.01 * random.normal(); };
        return stem_record{3 * column + shift + noise(), 3 * row + noise(), noise(), radius + 0.3 * noise()};
      };
      source.push_back(seen(0));
      target.push_back(seen(50));
      without_radii.push_back({target.back().x, target.back().y, target.back().z});
    }
  const temporary_directory directory;
  write_stems(directory / "source.csv", source);
  write_stems(directory / "target.csv", target);
  write_stems(directory / "without.csv", without_radii);
  REQUIRE(call(directory, "match_stems", "source.csv target.csv --out T.txt --json r.json").status == 0);
  const Eigen::Isometry3d t = read_transform(directory / "T.txt");
  CHECK((t.translation() - Eigen::Vector3d(50, 0, 0)).norm() < 0.1);
  const auto report = nlohmann::json::parse(bytes_of(directory / "r.json"));
  CHECK(report["hypotheses"][0]["evidence_source"] == "radii");
  CHECK_THAT(bytes_of(directory / "stdout.log"), Contains("radii in the plantation resolved the ambiguity"));
  CHECK(call(directory, "match_stems", "source.csv without.csv --out T.txt").status == 1);
}

TEST_CASE("match_stems follows a prior, and the stems where they contradict it, with a warning") {
  const temporary_directory directory;
  directory.file("source.csv", stem_csv(0, 0));
  directory.file("target.csv", stem_csv(0.7, 3));
  const std::string arguments = "source.csv target.csv --out T.txt --json r.json --prior ";
  directory.file("near.txt", "0.8 -0.6 0 3.5\n0.6 0.8 0 0\n0 0 1 0\n0 0 0 1\n");
  REQUIRE(call(directory, "match_stems", arguments + "near.txt --prior-sigma 1,5").status == 0);
  const auto near = nlohmann::json::parse(bytes_of(directory / "r.json"));
  CHECK(near["prior"]["contradicted"] == false);
  CHECK(near["prior"]["turn_deg"].get<double>() == Approx(3.24).margin(0.05));
  CHECK(near["warnings"].empty());
  directory.file("far.txt", "1 0 0 300\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  const run result = call(directory, "match_stems", arguments + "far.txt");
  CHECK(result.status == 0);
  CHECK_THAT(result.complaint, Contains("prior: the stems place the source"));
  const auto far = nlohmann::json::parse(bytes_of(directory / "r.json"));
  CHECK(far["prior"]["contradicted"] == true);
  CHECK(far["warnings"][0]["code"] == "prior_contradicted");
  CHECK((read_transform(directory / "T.txt").translation() - Eigen::Vector3d(3, 0, 0)).norm() < 1e-4);
}

TEST_CASE("match_stems says that a map is larger, and corrects it on demand") {
  const temporary_directory directory;
  directory.file("source.csv", stem_csv(0, 0));
  std::string larger = "x,y,z\n";
  for (const stem_record& s : read_stems(directory / "source.csv").stems)
    larger +=
        std::to_string(1.02 * s.x) + "," + std::to_string(1.02 * s.y) + "," + std::to_string(s.z) + "\n";
  directory.file("target.csv", larger);
  const run result = call(directory, "match_stems", "source.csv target.csv --out T.txt --json r.json");
  CHECK(result.status == 0);
  CHECK_THAT(result.complaint, Contains("scale: distances in target are 2 % longer than in source"));
  const auto report = nlohmann::json::parse(bytes_of(directory / "r.json"));
  CHECK(report["scale"]["factor"].get<double>() == Approx(1.02).margin(1e-4));
  CHECK(report["scale"]["applied"] == false);
  REQUIRE(call(directory, "match_stems", "source.csv target.csv --out T.txt --json r.json --scale").status ==
          0);
  double first = 0;
  std::istringstream(bytes_of(directory / "T.txt")) >> first;
  CHECK(first == Approx(1.02).margin(1e-4));
  CHECK(nlohmann::json::parse(bytes_of(directory / "r.json"))["scale"]["applied"] == true);
}

TEST_CASE("match_stems without an answer ends in status 1, removes an old matrix, and gives the reason") {
  const temporary_directory directory;
  directory.file("source.csv", stem_csv(0, 0));
  directory.file("target.csv", "x,y,z\n0,0,0\n1,5,0\n");
  for (const bool old : {false, true}) {
    if (old) directory.file("T.txt", "of an earlier run");
    const run result = call(directory, "match_stems", "source.csv target.csv --out T.txt --json r.json");
    CHECK(result.status == 1);
    CHECK_THAT(result.complaint, Contains("target: 2 stems"));
    CHECK_FALSE(std::filesystem::exists(directory / "T.txt"));
    CHECK(nlohmann::json::parse(bytes_of(directory / "r.json"))["outcome"] == "not_registered");
  }
}

TEST_CASE("a stem map without stems is an input like others: status 1") {
  const temporary_directory directory;
  directory.file("source.csv", "x,y,z\n");
  directory.file("target.csv", stem_csv(0, 0));
  CHECK(call(directory, "match_stems", "source.csv target.csv --out T.txt").status == 1);
}

TEST_CASE("wrong usage ends in status 2") {
  const temporary_directory directory;
  directory.file("a.csv", stem_csv(0, 0));
  for (const char* arguments :
       {"", "a.csv", "a.csv a.csv", "a.csv a.csv --out", "a.csv a.csv --out T.txt --dof 5",
        "a.csv a.csv --out T.txt --tolerance -1", "a.csv a.csv --out T.txt --what",
        "a.csv a.csv --out T.txt --prior none.txt", "a.csv a.csv --out T.txt --prior-sigma 1,2",
        "a.csv a.csv --out T.txt --prior a.csv", "a.csv a.csv --out T.txt --prior-sigma -1,2"}) {
    CAPTURE(arguments);
    const run result = call(directory, "match_stems", arguments);
    CHECK(result.status == 2);
    CHECK_FALSE(result.complaint.empty());
    CHECK_FALSE(std::filesystem::exists(directory / "T.txt"));
  }
}

TEST_CASE("a scan, a stem map and each scan of a file of several may come from standard input") {
  const temporary_directory directory;
  const std::string csv = stem_csv(0, 0);
  directory.file("stems.csv", csv);
  REQUIRE(call(directory, "match_stems", "- stems.csv --out T.txt < stems.csv").status == 0);
  CHECK(read_transform(directory / "T.txt").isApprox(Eigen::Isometry3d::Identity(), 1e-6));

  const std::string pose = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
  directory.file("two.ptx", "1\n1\n" + pose + "1 2 3 0\n2\n1\n" + pose + "1 2 3 0\n4 5 6 0\n");
  REQUIRE(call(directory, "scan_info", "- --json r.json < two.ptx").status == 0);
  const auto scans = nlohmann::json::parse(bytes_of(directory / "r.json"))["scans"];
  REQUIRE(scans.size() == 2);
  CHECK(scans[1]["path"] == "-#2");
  CHECK(scans[1]["points"] == 2);

  directory.file("empty", "");
  const run empty = call(directory, "map_stems", "- --out none.csv < empty");
  CHECK(empty.status == 2);
  CHECK_THAT(empty.complaint, Contains("standard input: is empty"));
  const run several = call(directory, "map_stems", "- --out none.csv < two.ptx");
  CHECK_THAT(several.complaint, Contains("standard input: holds 2 scans") && Contains("\"-#2\""));
  CHECK(!std::filesystem::exists(directory / "none.csv"));
}

TEST_CASE("scan_info expands patterns that the shell has not, and says where one matches nothing") {
  const temporary_directory directory;
  for (const char* name : {"a_1.xyz", "a_2.xyz", "b_1.xyz"}) directory.file(name, "1 2 3\n4 5 6\n");
  REQUIRE(call(directory, "scan_info", "'a_?.xyz' --json r.json").status == 0);
  const auto scans = nlohmann::json::parse(bytes_of(directory / "r.json"))["scans"];
  REQUIRE(scans.size() == 2);
  CHECK(scans[0]["path"] == "a_1.xyz");
  CHECK(scans[0]["classes"].is_null());
  const run none = call(directory, "scan_info", "'c*.xyz' a_1.xyz");
  CHECK(none.status == 2);
  CHECK_THAT(none.complaint, Contains("c*.xyz: matches no file"));
}

TEST_CASE("unreadable input ends in status 2, names the file and leaves old results alone") {
  const temporary_directory directory;
  directory.file("good.csv", stem_csv(0, 0));
  directory.file("bad.csv", "a,b\n1,2\n");
  directory.file("scan.ply", "ply\nformat ascii 1.0\nelement vertex 3\n");
  directory.file("T.txt", "old");
  const std::pair<const char*, const char*> calls[] = {
      {"match_stems", "good.csv bad.csv --out T.txt"},
      {"match_stems", "bad.csv good.csv --out T.txt"},
      {"match_stems", "good.csv absent.csv --out T.txt"},
      {"map_stems", "absent.ply --out T.txt"},
      {"register_scans", "scan.ply scan.ply --out T.txt"},
      {"evaluate_registration", "T.txt --truth T.txt --scan scan.ply"},
  };
  for (const auto& [program, arguments] : calls) {
    CAPTURE(program, arguments);
    const run result = call(directory, program, arguments);
    CHECK(result.status == 2);
    CHECK_THAT(result.complaint,
               Contains("bad.csv") || Contains("absent") || Contains("scan.ply") || Contains("T.txt"));
    CHECK(bytes_of(directory / "T.txt") == "old");
  }
}

TEST_CASE("an output that cannot be written ends in status 2 before anything else is replaced") {
  const temporary_directory directory;
  directory.file("a.csv", stem_csv(0, 0));
  directory.file("b.csv", stem_csv(0.7, 3));
  directory.file("T.txt", "old");
  directory.file("r.json", "old");
  for (const char* arguments :
       {"a.csv b.csv --out T.txt --json absent/r.json", "a.csv b.csv --out absent/T.txt --json r.json",
        "a.csv b.csv --out . --json r.json"}) {
    CAPTURE(arguments);
    const run result = call(directory, "match_stems", arguments);
    CHECK(result.status == 2);
    CHECK_THAT(result.complaint, Contains("absent") || Contains("directory"));
    CHECK(bytes_of(directory / "T.txt") == "old");
    CHECK(bytes_of(directory / "r.json") == "old");
  }
  CHECK(directory.count_files() == 6);  // with the two logs: nothing half-written
}

#ifdef GLOBALMATCH_HAS_SIMULATOR
TEST_CASE(
    "register_scans writes for CloudCompare and PDAL what fits to scans with the poses in their headers") {
  const temporary_directory directory;
  REQUIRE(call(directory, "simulate_plot", ". --stations 2 --angular-step 0.2 --seed 5").status == 0);
  const Eigen::Isometry3d pose =
      Eigen::Translation3d(500, 300, 10) * Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ());
  {
    const scan_file scan = open_scan(directory / "scan_2.ply");
    std::ofstream ptx(directory / "posed.ptx");
    ptx << std::setprecision(12) << scan.size() << "\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
    for (int row = 0; row < 4; ++row) ptx << pose.matrix().col(row).transpose() << '\n';
    for (const Eigen::Vector3d& p : scan) ptx << p.transpose() << " 0.5\n";
  }
  REQUIRE(call(directory, "register_scans",
               "posed.ptx scan_1.ply --out T.txt --out-as T.mat.txt --out-as T.dat --out-as posed_too.ptx")
              .status == 0);
  const Eigen::Isometry3d target_from_source = read_transform(directory / "T.txt");
  CHECK((read_transform(directory / "T.mat.txt") * pose).isApprox(target_from_source, 1e-9));
  CHECK(read_transform(directory / "T.dat").isApprox(target_from_source, 1e-12));
  CHECK_THAT(bytes_of(directory / "stdout.log"), Contains("apply the poses in the headers"));
  REQUIRE(call(directory, "register_scans", "scan_1.ply posed.ptx --out U.txt --out-as U.mat.txt").status ==
          0);
  CHECK(read_transform(directory / "U.mat.txt").isApprox(pose * read_transform(directory / "U.txt"), 1e-9));
}

TEST_CASE("simulated scans go through map_stems, match_stems and register_scans") {
  const temporary_directory directory;
  REQUIRE(call(directory, "simulate_plot", ". --stations 2 --angular-step 0.2 --seed 5").status == 0);
  for (const char* name : {"scan_1.ply", "scan_2.ply", "pose_1.txt", "pose_2.txt", "stems.csv"})
    CHECK(std::filesystem::exists(directory / name));
  const Eigen::Isometry3d truth =
      read_transform(directory / "pose_1.txt").inverse() * read_transform(directory / "pose_2.txt");
  const auto error = [&](const char* file) {
    const Eigen::Isometry3d t = read_transform(directory / file);
    return (t.translation() - truth.translation()).norm();
  };

  REQUIRE(call(directory, "map_stems", "scan_1.ply --out 1.csv --json m.json").status == 0);
  REQUIRE(call(directory, "map_stems", "scan_2.ply --out 2.csv").status == 0);
  const auto map = nlohmann::json::parse(bytes_of(directory / "m.json"));
  check_record(directory, map, {"scan_1.ply"});
  CHECK(map["stems"] == read_stems(directory / "1.csv").stems.size());
  CHECK(map["points"].is_number_integer());
  CHECK_FALSE(map["upright"]["tilted"].get<bool>());
  REQUIRE(call(directory, "match_stems", "2.csv 1.csv --out T.txt").status == 0);
  CHECK(error("T.txt") < 0.1);

  REQUIRE(call(directory, "register_scans",
               "scan_2.ply scan_1.ply --out T.txt --json r.json --write merged.ply --report plan.svg "
               "--out-as T.dat --out-as T.json")
              .status == 0);
  CHECK(bytes_of(directory / "T.dat") == bytes_of(directory / "T.txt"));
  CHECK_THAT(bytes_of(directory / "T.json"), Contains("filters.transformation"));
  CHECK(error("T.txt") < 0.1);
  const auto report = nlohmann::json::parse(bytes_of(directory / "r.json"));
  check_record(directory, report, {"scan_2.ply", "scan_1.ply"});
  CHECK(report["target"]["stems"] == map["stems"]);
  CHECK(std::filesystem::file_size(directory / "merged.ply") > 0);
  CHECK_THAT(bytes_of(directory / "plan.svg"), Contains("</svg>"));
  REQUIRE(call(directory, "register_scans", "scan_2.ply scan_1.ply --out T.txt --write merged.laz").status ==
          0);
  CHECK(open_scan(directory / "merged.laz").size() == open_scan(directory / "merged.ply").size());
  CHECK(call(directory, "register_scans", "scan_2.ply scan_1.ply --out T.txt --write scan_1.ply").status ==
        2);
  CHECK(call(directory, "register_scans", "scan_2.ply scan_1.ply --out T.txt --write merged.e57").status ==
        2);
  CHECK(call(directory, "match_stems", "2.csv 1.csv --out T.txt --out-as T.xml").status == 2);
  CHECK(call(directory, "evaluate_registration",
             "T.txt --source-pose pose_2.txt --target-pose pose_1.txt --scan scan_2.ply")
            .status == 0);

  REQUIRE(call(directory, "04_step_by_step", "scan_2.ply scan_1.ply").status == 0);
  CHECK_THAT(bytes_of(directory / "stdout.log"), Contains("fine"));
}

TEST_CASE(
    "a scan that was not level is warned of, and its vertical is that of its stems unless the given one is "
    "asked for") {
  const temporary_directory directory;
  REQUIRE(call(directory, "simulate_plot", ". --stations 1 --angular-step 0.2 --seed 5 --tilt 8").status ==
          0);
  const auto map_by = [&](const std::string& vertical) {
    const run mapped =
        call(directory, "map_stems", "scan_1.ply --out 1.csv --json m.json --vertical " + vertical);
    REQUIRE(mapped.status == 0);
    CHECK_THAT(mapped.complaint, Contains("scan_1.ply: its stems"));
    const auto map = nlohmann::json::parse(bytes_of(directory / "m.json"));
    CHECK(map["upright"]["tilted"].get<bool>());
    CHECK(map["upright"]["tilt_deg"].get<double>() == Approx(8).margin(1));
    return map["up_by_stems"].get<bool>();
  };
  CHECK(map_by("auto"));
  CHECK(map_by("stems"));
  CHECK_FALSE(map_by("given"));
  CHECK(call(directory, "map_stems", "scan_1.ply --out 1.csv --vertical up").status == 2);
}

TEST_CASE("simulate_plot with fewer stations than before leaves no scan of the earlier plot") {
  const temporary_directory directory;
  directory.file("scan_mine.ply", "mine");
  REQUIRE(call(directory, "simulate_plot", ". --stations 3 --angular-step 2").status == 0);
  REQUIRE(call(directory, "simulate_plot", ". --stations 2 --angular-step 2").status == 0);
  for (const char* gone : {"scan_3.ply", "pose_3.txt"}) CHECK(!std::filesystem::exists(directory / gone));
  for (const char* there : {"scan_2.ply", "pose_2.txt", "scan_mine.ply"})
    CHECK(std::filesystem::exists(directory / there));
}

TEST_CASE("simulate_plot takes a scene by name, with further options before or after it overriding it") {
  const temporary_directory directory;
  const std::string coarse = " --angular-step 2 --stations 1";
  REQUIRE(call(directory, "simulate_plot", "rows --scene plot_4" + coarse).status == 0);
  REQUIRE(call(directory, "simulate_plot", "wide" + coarse + " --tree-spacing 6 --scene plot_4").status == 0);
  const std::size_t stems = read_stems(directory / "rows/stems.csv").stems.size();
  const std::size_t stems_in_wide_rows = read_stems(directory / "wide/stems.csv").stems.size();
  CHECK(stems > 500);
  CHECK(double(stems_in_wide_rows) > 0.4 * double(stems));
  CHECK(double(stems_in_wide_rows) < 0.6 * double(stems));
  CHECK(!std::filesystem::exists(directory / "rows/scan_2.ply"));

  CHECK(call(directory, "simulate_plot", "--list-scenes").status == 0);
  CHECK_THAT(bytes_of(directory / "stdout.log"), Contains("plot_4"));
  const run unknown = call(directory, "simulate_plot", ". --scene nowhere");
  CHECK(unknown.status == 2);
  CHECK_THAT(unknown.complaint, Contains("nowhere") && Contains("plot_4"));
  const run impossible = call(directory, "simulate_plot", ". --slope 80");
  CHECK(impossible.status == 2);
  CHECK_THAT(impossible.complaint, Contains("ground_options.slope"));
}
#endif

}  // namespace globalmatch::support::test_programs

// evaluate_dataset, from folders of scans to tables: the same numbers in every layout, and mistakes.
#ifdef GLOBALMATCH_BENCHMARKS
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "catch.hpp"
#include "programs/program_run.hpp"
#include "support/e57_writer.hpp"
#include "support/scan_files.hpp"
#include "support/stem_files.hpp"
#include "support/temporary_directory.hpp"
#include "support/text_fields.hpp"
#include "support/transform_files.hpp"

namespace globalmatch::support::test_dataset_programs {

using Catch::Matchers::Contains;
using Eigen::Isometry3d;

namespace {

run evaluate(const temporary_directory& directory, const std::string& arguments) {
  return call_in(GLOBALMATCH_BENCHMARKS, directory, "evaluate_dataset", arguments);
}

/// Two scans that nothing can be mapped of, for mistakes that are found before.
void write_small_scans(const temporary_directory& directory) {
  std::filesystem::create_directory(directory / "plot");
  for (const char* name : {"plot/a.xyz", "plot/b.xyz"}) directory.file(name, "1 2 3\n4 5 6\n");
}

const std::string identity = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";

}  // namespace

TEST_CASE("evaluate_dataset refuses what it cannot use with status 2, names it and says what helps") {
  const temporary_directory directory;
  const auto require = [&](const std::string& arguments, const std::string& problem,
                           const std::string& remedy) {
    INFO(arguments);
    const run result = evaluate(directory, arguments);
    CHECK(result.status == 2);
    CHECK_THAT(result.complaint, Contains(problem) && Contains(remedy));
  };
  require("", "FOLDER", "--frozen");
  require("none", "none: is no folder", "Name the folder");
  std::filesystem::create_directory(directory / "empty");
  require("empty", "empty: holds no scans", "--scans");
  write_small_scans(directory);
  require("plot", "plot: holds scans, but no truth", "NAME.pose");
  directory.file("plot/a.pose", identity);
  require("plot", "has no truth for b", "Add the pose");
  directory.file("plot/b.pose", "1 0 0 0\n0 1 0 0\n0 0 2 0\n0 0 0 1\n");
  require("plot", "b.pose: holds a matrix that is no rotation", "Scale and shear");
  directory.file("plot/b.pose", identity);
  directory.file("plot/poses.csv", "a,1,0,0,0,0,1,0,0,0,0,1,0\nb,1,0,0,5,0,1,0,0,0,0,1,0\n");
  require("plot", "contradict each other", "--truth");
  require("plot --truth poses.csv --middle c", "there is no scan c", "is it a?");
  require("plot --methods indx", "there is no indx", "is it index?");
#ifdef GLOBALMATCH_HAS_SIMULATOR
  require("--frozen --scenes plot_9", "plot_9", "plot_1");
#else
  require("--frozen", "needs the simulator", "libembree-dev");
#endif
}

TEST_CASE("evaluate_dataset --list says what is there and what is missing") {
  const temporary_directory directory;
  write_small_scans(directory);
  directory.file("plot/a.pose", identity);
  REQUIRE(evaluate(directory, "plot --list").status == 2);
  CHECK_THAT(bytes_of(directory / "stdout.log"),
             Contains("scan  a") && Contains("problem: ") && Contains("has no truth for b"));
  directory.file("plot/b.pose", identity);
  directory.file("plot/a_stems.csv", "x,y\n1,2\n");
  REQUIRE(evaluate(directory, "plot --list").status == 0);
  CHECK_THAT(bytes_of(directory / "stdout.log"),
             Contains("scan  a  (the middle one)  true stems: a_stems.csv") &&
                 Contains("truth 4 x 4 matrices") && Contains("note: no true stems for 1 of 2 scans"));
}

#ifdef GLOBALMATCH_HAS_SIMULATOR
namespace {

constexpr std::size_t stations = 5;

/// Numbers of a table by column; what is different from run to run or by name is left out.
std::map<std::string, std::vector<double>> numbers_in(const std::filesystem::path& csv) {
  std::istringstream lines(bytes_of(csv));
  std::string line;
  std::getline(lines, line);
  std::vector<std::string> columns;
  for (const std::string_view name : split(line, ',')) columns.emplace_back(name);
  std::map<std::string, std::vector<double>> numbers;
  while (std::getline(lines, line)) {
    field_reader fields(line, ',');
    for (const std::string& column : columns) {
      const std::string text(fields.next().value_or(""));
      const bool differs = column.find("seconds") != column.npos || column == "plot" || column == "scan" ||
                           column == "source" || column == "target";
      if (differs) continue;
      const double other = text == "registered" ? 1 : std::nan("");
      numbers[column].push_back(to_number(text).value_or(other));
    }
  }
  return numbers;
}

void require_same(const std::filesystem::path& a, const std::filesystem::path& b) {
  const auto first = numbers_in(a), second = numbers_in(b);
  REQUIRE(first.size() == second.size());
  for (const auto& [column, values] : first) {
    INFO(b << ' ' << column);
    const auto& others = second.at(column);
    REQUIRE(values.size() == others.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (std::isnan(values[i]))
        CHECK(std::isnan(others[i]));
      else
        CHECK(values[i] == Approx(others[i]).margin(1e-9));
    }
  }
}

/// A simulated plot in the layouts that published sets have.
class layouts {
 public:
  layouts() {
    const run simulated =
        call(directory_, "simulate_plot", "plot --scene plot_a_like --seed 1 --angular-step 0.4");
    REQUIRE(simulated.status == 0);
    for (std::size_t k = 1; k <= stations; ++k)
      poses_.push_back(read_transform(directory_ / ("plot/pose_" + std::to_string(k) + ".txt")));
  }

  const temporary_directory& directory() const { return directory_; }
  const Isometry3d& pose(std::size_t k) const { return poses_[k - 1]; }

  /// The scans in a further folder, and the true stems unless they are to be in another frame.
  std::filesystem::path copy(const std::string& name, bool with_stems = true) const {
    const std::filesystem::path folder = directory_ / name;
    std::filesystem::create_directory(folder);
    for (std::size_t k = 1; k <= stations; ++k)
      std::filesystem::copy_file(directory_ / "plot" / scan(k), folder / scan(k));
    if (with_stems) copy_stems(folder);
    return folder;
  }

  void copy_stems(const std::filesystem::path& folder) const {
    std::filesystem::copy_file(directory_ / "plot/stems.csv", folder / "stems.csv");
  }

  /// The true stems in the frame of the first scan, with their returns.
  void write_stems_of_first(const std::filesystem::path& folder) const {
    const stem_table table = read_stems(directory_ / "plot/stems.csv");
    std::istringstream lines(bytes_of(directory_ / "plot/stems.csv"));
    std::string line;
    std::getline(lines, line);
    std::ostringstream csv;
    csv.precision(17);
    csv << line << '\n';
    for (const stem_record& s : table.stems) {
      const Eigen::Vector3d p = pose(1).inverse() * Eigen::Vector3d(s.x, s.y, s.z);
      std::getline(lines, line);
      std::size_t at = 0;
      for (int comma = 0; comma < 3; ++comma) at = line.find(',', at) + 1;
      csv << p.x() << ',' << p.y() << ',' << p.z() << ',' << line.substr(at) << '\n';
    }
    std::ofstream(folder / "stems.csv") << csv.str();
  }

  static std::string scan(std::size_t k) { return "scan_" + std::to_string(k) + ".ply"; }

  points points_of(std::size_t k) const {
    const scan_file file = open_scan(directory_ / "plot" / scan(k));
    return {file.begin(), file.end()};
  }

  Isometry3d between(std::size_t source, std::size_t target) const {
    return pose(target).inverse() * pose(source);
  }

 private:
  temporary_directory directory_;
  std::vector<Isometry3d> poses_;
};

std::string matrix_text(const Isometry3d& transform, const std::string& separator) {
  std::ostringstream text;
  text.precision(17);
  for (Eigen::Index i = 0; i < 16; ++i) text << (i > 0 ? separator : "") << transform.matrix()(i / 4, i % 4);
  return text.str();
}

std::string ptx_of(const points& all, const Isometry3d& pose) {
  std::ostringstream text;
  text.precision(17);
  const Eigen::Matrix4d transposed = pose.matrix().transpose();
  text << all.size() << "\n1\n";
  for (const Eigen::Index row : {3, 0, 1, 2})
    text << transposed(row, 0) << ' ' << transposed(row, 1) << ' ' << transposed(row, 2) << '\n';
  for (Eigen::Index row = 0; row < 4; ++row)
    text << transposed(row, 0) << ' ' << transposed(row, 1) << ' ' << transposed(row, 2) << ' '
         << transposed(row, 3) << '\n';
  for (const Eigen::Vector3d& p : all) text << p.x() << ' ' << p.y() << ' ' << p.z() << " 0.5\n";
  return text.str();
}

written_scan e57_of(const points& all, const Isometry3d& pose) {
  written_scan scan;
  const char* names[] = {"cartesianX", "cartesianY", "cartesianZ"};
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<float> values;
    for (const Eigen::Vector3d& p : all) values.push_back(static_cast<float>(p[axis]));
    scan.fields.push_back(float_field(names[axis], values));
  }
  scan.pose = e57_pose(Eigen::Quaterniond(pose.linear()), pose.translation());
  return scan;
}

}  // namespace

TEST_CASE("evaluate_dataset gives the numbers of --frozen for the same scans in every layout", "[slow]") {
  const layouts all;
  const temporary_directory& directory = all.directory();
  const std::string options = " --tables 2,3,4,5 --no-figures --threads 2 --out-dir ";
  REQUIRE(
      evaluate(directory, "--frozen --scenes plot_a_like --seeds 1 --angular-step 0.4" + options + "frozen")
          .status == 0);
  const auto require = [&](const std::string& layout, const std::string& more = "") {
    INFO(layout);
    const run result = evaluate(directory, layout + more + options + layout + "_out");
    INFO(result.complaint);
    REQUIRE(result.status == 0);
    for (const char* table : {"scans.csv", "pairs.csv"})
      require_same(directory / "frozen" / table, directory / (layout + "_out") / table);
  };
  REQUIRE(numbers_in(directory / "frozen/pairs.csv").at("right") == std::vector<double>(10, 1));

  require("plot");  // pose_K.txt

  const auto named = all.copy("named"), by_pattern = all.copy("by_pattern"), table = all.copy("table");
  std::filesystem::create_directory(by_pattern / "truth");
  std::string csv = "scan,matrix\n";
  for (std::size_t k = 1; k <= stations; ++k) {
    const std::string number = std::to_string(k);
    write_transform(named / ("scan_" + number + ".pose"), all.pose(k));
    write_transform(by_pattern / ("truth/T" + number + ".dat"), all.pose(k).inverse());
    csv += "scan_" + number + "," + matrix_text(all.pose(k), ",") + '\n';
  }
  directory.file("table/poses.csv", csv);
  require("named");
  require("by_pattern", " --pose-files \"truth/T{number}.dat\" --inverse-truth");
  require("table");

  const auto pairs = all.copy("pairs", false), pair_table = all.copy("pair_table", false);
  std::string blocks;
  for (std::size_t k = 2; k <= stations; ++k) {
    const std::string number = std::to_string(k);
    write_transform(pairs / ("scan_" + number + "-scan_1.pose"), all.between(k, 1));
    std::string matrix = matrix_text(all.between(1, k), " ");
    for (std::size_t i = 0, blanks = 0; i < matrix.size(); ++i)
      if (matrix[i] == ' ' && ++blanks % 4 == 0) matrix[i] = '\n';
    blocks += "1 " + number + " 5\n" + matrix + '\n';
  }
  directory.file("pair_table/gt.log", blocks);
  all.write_stems_of_first(pairs);
  all.write_stems_of_first(pair_table);
  require("pairs", " --stems-in scan_1");
  require("pair_table", " --stems-in scan_1");

  std::filesystem::create_directory(directory / "ptx");
  std::filesystem::create_directory(directory / "e57");
  std::vector<written_scan> scans;
  for (std::size_t k = 1; k <= stations; ++k) {
    directory.file("ptx/scan_" + std::to_string(k) + ".ptx", ptx_of(all.points_of(k), all.pose(k)));
    scans.push_back(e57_of(all.points_of(k), all.pose(k)));
  }
  directory.file("e57/project.e57", e57_file(scans));
  all.copy_stems(directory / "ptx");
  all.copy_stems(directory / "e57");
  require("ptx");
  require("e57");
}

TEST_CASE("evaluate_dataset ends in status 2 where its registrations contradict the truth, and says why",
          "[slow]") {
  const layouts all;
  const std::string options = " --tables 2,3,5 --no-figures --threads 2 --out-dir out";
  const run result = evaluate(all.directory(), "plot --inverse-truth" + options);
  CHECK(result.status == 2);
  for (const std::string& text : {result.complaint, bytes_of(all.directory() / "out/tables.md")})
    CHECK_THAT(text, Contains("contradicts all 10 registrations") &&
                         Contains("inverse: give --inverse-truth") && Contains("stand at a true stem"));
}

TEST_CASE("evaluate_dataset counts registrations without ICP in table 3, whose errors are unknown",
          "[slow]") {
  const layouts all;
  const run result =
      evaluate(all.directory(), "plot --icp none --tables 3 --no-figures --threads 2 --out-dir out");
  CHECK(result.status == 0);
  CHECK_THAT(bytes_of(all.directory() / "out/tables.md"), Contains("| plot | 4 of 4, errors of 0 | - |"));
}

TEST_CASE("evaluate_dataset writes tables with the paper's numbers beside those of a plot of its name",
          "[slow]") {
  const layouts all;
  const temporary_directory& directory = all.directory();
  std::filesystem::create_directory(directory / "set");
  std::filesystem::rename(directory / "plot", directory / "set/WHU-FGI");
  const run result = evaluate(
      directory, "set --tables 2,6,7 --methods index --sizes 20 --ranges 8 --python no_python --out-dir out");
  REQUIRE(result.status == 0);
  CHECK_THAT(result.complaint, Contains("no figures") && Contains("Debian: python3-matplotlib"));
  const std::string tables = bytes_of(directory / "out/tables.md");
  const std::size_t own = tables.find("| WHU-FGI | 5 | "),
                    beside = tables.find("| *WHU-FGI* | - | 97.1 | 95.8 |");
  REQUIRE(own != tables.npos);
  REQUIRE(beside != tables.npos);
  CHECK(own < beside);
  CHECK(beside < tables.find("The paper's own data"));
  CHECK_THAT(tables, Contains("([GM] table 6)") && Contains("([GM] table 7)") && !Contains("([GM] table 5)"));
  CHECK_THAT(tables, Contains("| stems in both maps | index |\n|---|---|\n| from "));
  const auto runs = numbers_in(directory / "out/matching.csv");
  REQUIRE(runs.at("source_stems").size() == 30);  // ten pairs: cut off, simplified and whole
  CHECK(std::count(runs.at("source_stems").begin(), runs.at("source_stems").end(), 20) >= 10);
  const auto scans = numbers_in(directory / "out/scans.csv");
  for (const double stems : scans.at("no_verticality_stems")) CHECK(stems > 20);
}
#endif

}  // namespace globalmatch::support::test_dataset_programs
#endif

// Truth of published sets, as evaluate_dataset reads it: matrices, names, which form counts, true stems.
#include <Eigen/Geometry>

#include <cmath>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "catch.hpp"
#include "dataset/find_plots.hpp"
#include "dataset/paper_tables.hpp"
#include "dataset/wilson.hpp"
#include "support/file_checks.hpp"
#include "support/temporary_directory.hpp"
#include "support/transform_files.hpp"

namespace globalmatch::test_dataset_truth {

using namespace benchmarks;
using Catch::Matchers::Contains;
using Eigen::Isometry3d;
using support::error_of;
using support::temporary_directory;

namespace {

Isometry3d pose_at(double x, double y, double yaw) {
  return Eigen::Translation3d(x, y, 0.5) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
}

/// Poses of three scans, none of them at the origin; the second is between the others.
std::vector<Isometry3d> three_poses() {
  return {pose_at(-10, 1, 0.3), pose_at(1, 2, 2), pose_at(14, 0, -1)};
}

/// A folder with scans a, b and c.
struct three_scans : temporary_directory {
  three_scans() {
    for (const char* name : {"a.xyz", "b.xyz", "c.xyz"}) file(name, "1 2 3\n4 5 6\n");
  }
  void write(const std::string& name, const Isometry3d& transform) const {
    support::write_transform(path() / name, transform);
  }
  stored_plot find(const dataset_options& options = {}) const { return find_plot(path(), options); }
  std::string error(const dataset_options& options = {}) const {
    return error_of([&] { find(options); });
  }
};

Isometry3d between(std::size_t source, std::size_t target) {
  return three_poses()[target].inverse() * three_poses()[source];
}

void require_truth(const stored_plot& plot) {
  for (std::size_t target = 0; target < 3; ++target)
    for (std::size_t source = 0; source < 3; ++source)
      CHECK(plot.truth.target_from_source(source, target).isApprox(between(source, target), 1e-12));
}

std::string row_of(const Isometry3d& transform, const char* separator) {
  std::ostringstream row;
  row.precision(17);
  for (Eigen::Index i = 0; i < 16; ++i) row << separator << transform.matrix()(i / 4, i % 4);
  return row.str();
}

}  // namespace

TEST_CASE("poses beside the scans are found by name and by number") {
  const three_scans folder;
  folder.write("a.pose", three_poses()[0]);
  folder.write("pose_b.txt", three_poses()[1]);
  folder.write("c_pose.txt", three_poses()[2]);
  require_truth(folder.find());

  const temporary_directory numbered;
  for (const char* name : {"scan_1.xyz", "scan_02.xyz"}) numbered.file(name, "1 2 3\n");
  support::write_transform(numbered / "pose_1.txt", three_poses()[0]);
  support::write_transform(numbered / "pose_2.txt", three_poses()[1]);
  const stored_plot plot = find_plot(numbered.path(), {});
  CHECK(plot.names == std::vector<std::string>{"scan_02", "scan_1"});
  CHECK(plot.truth.target_from_source(1, 0).isApprox(between(0, 1), 1e-12));
}

TEST_CASE("files named as those of TCF are pairs, source first, and the rest of a scan's name is ignored") {
  const temporary_directory folder;
  for (const char* name : {"s1_v0.1_sor.xyz", "s2_v0.1_sor.xyz", "s3_v0.1_sor.xyz"})
    folder.file(name, "1 2 3\n");
  support::write_transform(folder / "s2-s1.pose", between(1, 0));
  support::write_transform(folder / "s2-s3.pose", between(1, 2));
  support::write_transform(folder / "s3-s1.pose", between(2, 0));
  folder.file("s2_s1_top3.match", "1 2 3\n");
  const stored_plot plot = find_plot(folder.path(), {});
  require_truth(plot);
  CHECK(plot.truth.is_of_pairs());
  CHECK(plot.names[plot.middle] == "s2_v0.1_sor");
}

TEST_CASE("poses in folders of their own are found by a pattern") {
  const three_scans folder;
  std::filesystem::create_directory(folder / "poses");
  const char* names[] = {"a", "b", "c"};
  for (std::size_t i = 0; i < 3; ++i)
    folder.write(std::string("poses/T_of_") + names[i] + "_final.txt", three_poses()[i]);
  CHECK_THAT(folder.error(), Contains("no truth"));
  dataset_options options;
  options.truth.pose_files = "poses/*_{name}_*.txt";
  require_truth(folder.find(options));
}

TEST_CASE("pairs are found by a pattern, and as matrices from target to source") {
  const three_scans folder;
  folder.write("of a and b.txt", between(0, 1).inverse());
  folder.write("of c and b.txt", between(2, 1).inverse());
  dataset_options options;
  options.truth.pair_files = "of {source} and {target}.txt";
  options.truth.inverse = true;
  require_truth(folder.find(options));
}

TEST_CASE(
    "a table has a matrix for each scan: a line with or without a header, or four lines below the name") {
  const std::string names[] = {"a", "b.xyz", "c"};
  std::string csv = "scan", text, blocks = "# poses\n";
  for (int i = 0; i < 16; ++i) csv += ",m" + std::to_string(i);
  csv += '\n';
  for (std::size_t i = 0; i < 3; ++i) {
    csv += names[i] + row_of(three_poses()[i], ",") + '\n';
    text += names[i] + row_of(three_poses()[i], "\t") + '\n';
    std::ostringstream block;
    block.precision(17);
    block << names[i] << '\n' << three_poses()[i].matrix() << "\n\n";
    blocks += block.str();
  }
  for (const auto& [file, content] :
       {std::pair("poses.csv", csv), std::pair("poses.txt", text), std::pair("gt.log", blocks)}) {
    INFO(file);
    const three_scans folder;
    folder.file(file, content);
    require_truth(folder.find());
  }
}

TEST_CASE("a first column that counts the lines of a table is no scan, and one that is of none is refused") {
  const std::string scans[] = {"a", "b", "c"}, numbered[] = {"1", "2", "3"};
  const auto table = [](const std::string& header, int first, const std::string* names) {
    std::string csv = header;
    for (int i = 0; i < 3; ++i)
      csv += std::to_string(first + i) + "," + names[i] + row_of(three_poses()[std::size_t(i)], ",") + '\n';
    return csv;
  };
  const std::string matrix = ",m0,m1,m2,m3,m4,m5,m6,m7,m8,m9,m10,m11,m12,m13,m14,m15\n";
  for (const std::string& csv : {table(",name" + matrix, 0, scans), table("id,name" + matrix, 1, scans),
                                 table("", 0, scans), table("", 7, scans)}) {
    INFO(csv);
    const three_scans folder;
    folder.file("poses.csv", csv);
    const stored_plot plot = folder.find();
    require_truth(plot);
    CHECK(!plot.truth.is_of_pairs());
  }
  const temporary_directory folder;
  for (const char* name : {"scan_1.xyz", "scan_2.xyz", "scan_3.xyz"}) folder.file(name, "1 2 3\n");
  folder.file("poses.csv", table("", 0, numbered));
  CHECK_THAT(error_of([&] { find_plot(folder.path(), {}); }), Contains("poses.csv, line 1") &&
                                                                  Contains("of 0, which is no scan") &&
                                                                  Contains("id in a header"));
  folder.file("poses.csv", table(",name" + matrix, 0, numbered));
  require_truth(find_plot(folder.path(), {}));
}

TEST_CASE("matrices are read with commas, brackets, a byte order mark and lines of remarks") {
  const auto text = [](const Isometry3d& transform, const char* before, const char* separator,
                       const char* after) {
    std::ostringstream out;
    out.precision(17);
    for (Eigen::Index i = 0; i < 4; ++i) {
      out << before;
      for (Eigen::Index k = 0; k < 4; ++k) out << (k > 0 ? separator : "") << transform.matrix()(i, k);
      out << after << '\n';
    }
    return out.str();
  };
  const three_scans folder;
  folder.file("pose_a.txt", "\xEF\xBB\xBF# plot from scan\n" + text(three_poses()[0], "", ", ", ""));
  folder.file("pose_b.txt", "[" + text(three_poses()[1], "[", " ", "]") + "]");
  folder.file("c.txt", text(three_poses()[2], "", ";", ""));
  require_truth(folder.find());
}

TEST_CASE("names in tables may be behind folders, and in other letters") {
  const three_scans folder;
  folder.file("poses.csv", "Plot1/a.xyz" + row_of(three_poses()[0], ",") + "\nplot\\b" +
                               row_of(three_poses()[1], ",") + "\nC" + row_of(three_poses()[2], ",") + '\n');
  require_truth(folder.find());
}

TEST_CASE("truth that cannot be used is named, with what was asked for") {
  const auto require = [](const std::string& file, const std::string& content, const std::string& problem) {
    INFO(file << ' ' << content);
    const three_scans folder;
    folder.file(file, content);
    CHECK_THAT(folder.error(), Contains(problem));
  };
  require("pose_a.txt", "", "pose_a.txt: holds 0 numbers");
  require("pose_a.txt", "Matrix\n1 0 0 0\n", "pose_a.txt: line 1 has 'Matrix' where a number is expected");
  require("pose_a.txt", "1,0 0,0 0,0 0,0\n0,0 1,0 0,0 0,0\n0,0 0,0 1,0 0,0\n",
          "beyond the 16 numbers of a transform. Decimals have a point");
  require("a.txt", "Taken in spring\n", "no truth of their places; ");
  require("a.txt", "Taken in spring\n", "a.txt: line 1 has 'Taken' where");
  require("pose_a.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n5 6 7 1\n", "Is it transposed?");
  require("poses.csv", "d" + row_of(three_poses()[0], ",") + '\n', "is of d, which is no scan here");
  dataset_options options;
  options.truth.pose_files = "GT/{name}.txt";
  CHECK_THAT(three_scans().error(options), Contains("that --pose-files GT/{name}.txt gives"));
  options.truth = {};
  options.truth.headers = true;
  CHECK_THAT(three_scans().error(options), Contains("no header of a PTX or E57 file has a pose"));
}

TEST_CASE("what cannot be used is refused before anything is mapped: true stems, and scans without points") {
  const three_scans folder;
  for (std::size_t i = 0; i < 3; ++i) folder.write(std::string(1, char('a' + i)) + ".pose", three_poses()[i]);
  folder.file("stems.csv", "1,2,3\n4,5,6\n");
  CHECK_THAT(folder.error(), Contains("stems.csv: has no line that names the columns"));
  folder.file("stems.csv", "x,y\n1,2\n");
  CHECK(folder.error().empty());
  folder.file("b.xyz", "");
  CHECK_THAT(folder.error(), Contains("b.xyz: is empty"));
}

TEST_CASE("scanners further apart than any sees are noted, as of a truth in millimetres") {
  const three_scans folder;
  for (std::size_t i = 0; i < 3; ++i) {
    Isometry3d pose = three_poses()[i];
    pose.translation() *= 1000;
    folder.write(std::string(1, char('a' + i)) + ".pose", pose);
  }
  CHECK_THAT(folder.find().notes.at(0), Contains("a 11045 m from b: is it in metres?"));
}

TEST_CASE("poses of scans that are not there are noted") {
  const three_scans folder;
  const char* names[] = {"a.pose", "pose_b.txt", "c_pose.txt"};
  for (std::size_t i = 0; i < 3; ++i) folder.write(names[i], three_poses()[i]);
  folder.write("pose_d.txt", three_poses()[0]);
  folder.write("e.pose", three_poses()[0]);
  const stored_plot plot = folder.find();
  require_truth(plot);
  std::string notes;
  for (const std::string& note : plot.notes) notes += note + '\n';
  CHECK_THAT(notes, Contains("pose_d.txt is of no scan here") && Contains("e.pose is of no scan here"));
}

TEST_CASE("a table has a matrix for each pair, also with counted scans as in gt.log") {
  std::ostringstream log;
  log.precision(17);
  log << "0 1 3\n" << between(0, 1).matrix() << "\n2\t1\t3\n" << between(2, 1).matrix() << '\n';
  const temporary_directory numbered;
  for (const char* name : {"cloud_0.xyz", "cloud_1.xyz", "cloud_2.xyz"}) numbered.file(name, "1 2 3\n");
  numbered.file("gt.log", log.str());
  require_truth(find_plot(numbered.path(), {}));

  const three_scans folder;
  folder.file("all_pairs.txt", "source;target;matrix\na;b" + row_of(between(0, 1), ";") + "\nb;c" +
                                   row_of(between(1, 2), ";") + "\n");
  dataset_options options;
  options.truth.table = "all_pairs.txt";
  require_truth(folder.find(options));
}

TEST_CASE("a matrix in a table that is no rigid transform is refused with its line") {
  const three_scans folder;
  folder.file("poses.csv", "a" + row_of(three_poses()[0], ",") + "\nb,2,0,0,0,0,2,0,0,0,0,2,0,0,0,0,1\n");
  CHECK_THAT(folder.error(), Contains("poses.csv: line 2 holds a matrix that is no rotation"));
  folder.file("poses.csv", "a" + row_of(three_poses()[0], ",") + "\nb,2,0,0\n");
  CHECK_THAT(folder.error(), Contains("poses.csv: line 2"));
  folder.file("poses.csv", "a,1,0,0,0,0,1,0,0,0,0,1,x\nb,1,0,0,0,0,1,0,0,0,0,1,0\n");
  CHECK_THAT(folder.error(), Contains("no truth for a, c"));
}

TEST_CASE(
    "scans without truth, with truth of some, and matrices that are not rigid are errors that say what "
    "helps") {
  const three_scans folder;
  CHECK_THAT(folder.error(), Contains("no truth of their places") && Contains("NAME.pose"));
  folder.write("a.pose", three_poses()[0]);
  folder.write("b.pose", three_poses()[1]);
  CHECK_THAT(folder.error(),
             Contains("has no truth for c") && Contains("a.pose") && Contains("Add the pose"));
  folder.file("c.pose", "1 0 0 0\n0 1 0 0\n0 0 1.1 0\n0 0 0 1\n");
  CHECK_THAT(folder.error(), Contains("c.pose") && Contains("no rotation"));
}

TEST_CASE("pairs that do not connect all scans are an error") {
  const three_scans folder;
  folder.write("a-b.pose", between(0, 1));
  CHECK_THAT(folder.error(), Contains("has no truth for c") && Contains("connected"));
}

TEST_CASE("two truths must agree, and each within itself") {
  const three_scans folder;
  const char* names[] = {"a.pose", "b.pose", "c.pose"};
  for (std::size_t i = 0; i < 3; ++i) folder.write(names[i], three_poses()[i]);
  folder.write("a-b.pose", between(0, 1));
  folder.write("b-c.pose", between(1, 2));
  require_truth(folder.find());
  folder.write("b-c.pose", Eigen::Translation3d(0.5, 0, 0) * between(1, 2));
  CHECK_THAT(folder.error(), Contains("two truths that contradict each other") && Contains("0.5 m") &&
                                 Contains("--pose-files"));
  dataset_options poses_only;
  poses_only.truth.pose_files = "{name}.pose";
  require_truth(folder.find(poses_only));
  folder.write("pose_a.txt", three_poses()[1]);
  CHECK_THAT(folder.error(), Contains("pose_a.txt") && Contains("contradicts") && Contains("a.pose"));
}

TEST_CASE("pairs whose chains do not close are an error, which knows where the direction is the other") {
  const three_scans folder;
  folder.write("a-b.pose", between(0, 1).inverse());
  folder.write("b-c.pose", between(1, 2).inverse());
  folder.write("c-a.pose", between(2, 0).inverse());
  CHECK_THAT(folder.error(), Contains("contradicts the chain") && Contains("--inverse-truth"));
  dataset_options options;
  options.truth.inverse = true;
  require_truth(folder.find(options));
  folder.write("c-a.pose", between(2, 1));
  CHECK_THAT(folder.error(), Contains("contradicts the chain") && Contains("Correct or remove"));
}

TEST_CASE("poses in headers are a truth, unless all are the same, and may contradict another") {
  const temporary_directory folder;
  const auto write = [&](const std::string& name, double x) {
    const std::string place = std::to_string(x) + " 0 0";
    folder.file(name, "1\n2\n" + place + "\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n" + place +
                          " 1\n1 2 3 0.5\n4 5 6 0.5\n");
  };
  write("a.ptx", 0);
  write("b.ptx", 0);
  CHECK_THAT(error_of([&] { find_plot(folder.path(), {}); }), Contains("no truth of their places"));
  write("b.ptx", 7);
  CHECK(find_plot(folder.path(), {}).truth.target_from_source(1, 0).translation() ==
        Eigen::Vector3d(7, 0, 0));
  support::write_transform(folder / "b-a.pose", Isometry3d(Eigen::Translation3d(9, 0, 0)));
  CHECK_THAT(error_of([&] { find_plot(folder.path(), {}); }), Contains("contradict") && Contains("2 m"));
  dataset_options headers;
  headers.truth.headers = true;
  CHECK_FALSE(find_plot(folder.path(), headers).truth.is_of_pairs());
}

TEST_CASE("a folder without scans is refused, one with plots in subfolders has them by name") {
  const temporary_directory folder;
  CHECK_THAT(error_of([&] { find_plots(folder.path(), {}); }),
             Contains("holds no scans") && Contains("--scans"));
  CHECK_THAT(error_of([&] { find_plots(folder / "none", {}); }), Contains("is no folder"));
  for (const std::string plot : {"second", "first", "empty"}) {
    std::filesystem::create_directory(folder / plot);
    if (plot == "empty") continue;
    for (const char* scan : {"/a.txt", "/b.txt"}) folder.file(plot + scan, "1 2 3\n");
    for (const char* pose : {"/a.pose", "/b.pose"})
      folder.file(plot + pose, "1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 1\n");
  }
  dataset_options options;
  options.scans = "?.txt";
  const std::vector<stored_plot> plots = find_plots(folder.path(), options);
  REQUIRE(plots.size() == 2);
  CHECK(plots[0].name == "first");
  CHECK(plots[1].names == std::vector<std::string>{"a", "b"});
}

TEST_CASE("the middle scan is the one nearest to all others, or the one that is named") {
  const three_scans folder;
  const char* names[] = {"a.pose", "b.pose", "c.pose"};
  for (std::size_t i = 0; i < 3; ++i) folder.write(names[i], three_poses()[i]);
  CHECK(folder.find().middle == 1);
  dataset_options options;
  options.middle = "c";
  CHECK(folder.find(options).middle == 2);
  options.middle = "d";
  CHECK_THROWS_WITH(folder.find(options), Contains("there is no scan d"));
}

TEST_CASE("stems of a plot need its frame, those of a scan do not") {
  const three_scans folder;
  folder.write("a-b.pose", between(0, 1));
  folder.write("b-c.pose", between(1, 2));
  folder.file("stems.csv", "x,y,z,returns_a\n1,2,3,50\n");
  const stored_plot unused = folder.find();
  CHECK_FALSE(unused.stems[0]);
  CHECK_THAT(unused.notes[0], Contains("--stems-in"));
  dataset_options options;
  options.truth.root = "b";
  const stored_plot used = folder.find(options);
  REQUIRE(used.stems[0]);
  CHECK(used.truth.plot_from_scan(1).isApprox(Isometry3d::Identity()));
  const stem_truth truth = read_stem_truth(*used.stems[0], "a", used.truth.plot_from_scan(0));
  CHECK(truth.positions[0] == Eigen::Vector3d(1, 2, 3));
  REQUIRE(truth.returns);
  CHECK(truth.returns->at(0) == 50);
  CHECK_FALSE(read_stem_truth(*used.stems[1], "b", Isometry3d::Identity()).returns);
  folder.file("a_stems.csv", "x,y,z\n1,2,3\n");
  const auto of_scan = folder.find().stems[0];
  REQUIRE((of_scan && of_scan->is_of_scan));
  const Isometry3d pose = three_poses()[0];
  CHECK(read_stem_truth(*of_scan, "a", pose).positions[0].isApprox(pose * Eigen::Vector3d(1, 2, 3)));
}

TEST_CASE("returns are counted on the stem, between 0.2 and 3 m above its base") {
  stem_truth truth{{{10, 0, 1}, {-3, 4, 0}}, {0.2, std::nan("")}, true, {}, true};
  const Isometry3d pose = pose_at(10, 0, 0.4);
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(10.2, 0, 2),
                                   {9.8, 0, 3.9},
                                   {10, 0.24, 1.3},  // on it
                                   {10.26, 0, 2},
                                   {10.2, 0, 1.1},
                                   {10.2, 0, 4.1},  // beside it
                                   {-3.2, 4, 1}})
    points.push_back(pose.inverse() * p);
  points.push_back(Eigen::Vector3d::Constant(std::nan("")));
  CHECK(count_returns(points, pose, truth) == std::vector<std::uint32_t>{3, 1});
}

TEST_CASE("the interval of Wilson is that of his formula") {
  CHECK(wilson_interval(0, 0).high == 1);
  // Agresti and Coull (1998): 0 of 10 gives [0, 0.278], 5 of 10 [0.237, 0.763].
  CHECK(wilson_interval(0, 10).low == Approx(0).margin(1e-12));
  CHECK(wilson_interval(0, 10).high == Approx(0.278).margin(5e-4));
  CHECK(wilson_interval(5, 10).low == Approx(0.237).margin(5e-4));
  CHECK(wilson_interval(5, 10).high == Approx(0.763).margin(5e-4));
}

TEST_CASE("plots of the paper are known by name, and simulated ones like them are none") {
  for (const char* name : {"Plot #2", "plot_2", "Tongji-Trees plot 2", "TongjiTrees_Plot2"}) {
    INFO(name);
    REQUIRE(find_paper_plot(name));
    CHECK(find_paper_plot(name)->precision == 97.6);
  }
  CHECK(find_paper_plot("ETH_Trees")->methods[3].success == 100);
  CHECK(find_paper_plot("whu-fgi")->seconds_without == 102.4);
  for (const char* name : {"plot_2_101", "plot", "plot_5"}) CHECK_FALSE(find_paper_plot(name));
}

}  // namespace globalmatch::test_dataset_truth

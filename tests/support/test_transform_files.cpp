#include "support/transform_files.hpp"

#include "catch.hpp"
#include "file_checks.hpp"

namespace globalmatch::support::test_transform_files {

TEST_CASE("a written transform is read as the same bits") {
  const temporary_directory directory;
  Eigen::Isometry3d written = Eigen::Isometry3d::Identity();
  written.rotate(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  written.translation() = Eigen::Vector3d(1e6 + 0.1, -1.0 / 3, 1e-17);
  write_transform(directory / "T.txt", written);
  CHECK(read_transform(directory / "T.txt").matrix() == written.matrix());
}

TEST_CASE("a transform is written as four lines of four numbers") {
  const temporary_directory directory;
  Eigen::Isometry3d shift = Eigen::Isometry3d::Identity();
  shift.translation() = Eigen::Vector3d(1, 2.5, -3);
  write_transform(directory / "T.txt", shift);
  CHECK(bytes_of(directory / "T.txt") == "1 0 0 1\n0 1 0 2.5\n0 0 1 -3\n0 0 0 1\n");
}

TEST_CASE("a transform may have nine digits, tabs, CRLF and blank lines") {
  const temporary_directory directory;
  const auto path = directory.file("T.txt",
                                   "-0.991468219\t-0.130348653 0.000000000 -49.983712491\r\n\r\n"
                                   "0.130348653 -0.991468219 0.000000000 -55.622604926\r\n"
                                   " 0 0 1 -1.9\r\n0.0 0.0 0.0 1.0");
  CHECK(read_transform(path).translation() == Eigen::Vector3d(-49.983712491, -55.622604926, -1.9));
}

TEST_CASE("a transform may have commas, brackets and lines of remarks") {
  const temporary_directory directory;
  const auto path =
      directory.file("T.txt", "# b from a\n[[1, 0, 0, 1.5]\n [0; 1; 0; 2]\n [0 0 1 3]\n [0,0,0,1]]\n");
  CHECK(read_transform(path).isApprox(Eigen::Isometry3d(Eigen::Translation3d(1.5, 2, 3)), 0));
}

TEST_CASE("what is no rigid transform is refused with the reason") {
  const temporary_directory directory;
  const auto require = [&](const std::string& text, const std::string& problem, const std::string& remedy) {
    require_error(directory.file("T.txt", text), read_transform, problem, remedy);
  };
  require("", "holds 0 numbers", "four lines of four numbers");
  require("1 0 0 0\n0 1 0 0\n0 0 1 0\n", "holds 12 numbers", "four lines of four numbers");
  require("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n5\n", "line 5 is beyond the 16 numbers", "four lines");
  require("1 0 0 0\n0 1 0 zero\n0 0 1 0\n0 0 0 1\n", "line 2 has 'zero'", "four lines of four numbers");
  require("1 0 0 0\n0 1 0 nan\n0 0 1 0\n0 0 0 1\n", "not finite", "four lines of four numbers");
  require("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 2\n", "row 0 0 0 1", "four lines of four numbers");
  require("1 0 0 0\n0 1 0 0\n0 0 1 0\n7 8 9 1\n", "row 0 0 0 1", "four lines of four numbers");
  require("2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n", "not orthonormal", "Scale and shear");
  require("1 0 0 0\n0 1 1e-4 0\n0 0 1 0\n0 0 0 1\n", "not orthonormal", "7 digits");
  require("1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n", "reflection", "signs");
}

TEST_CASE("the true transforms of the real scans are rigid") {
  const std::filesystem::path clouds = std::filesystem::path(GLOBALMATCH_SHARED_DATA) / "clouds";
  if (!std::filesystem::is_directory(clouds)) {
    WARN("skipped: the folder of real scans does not exist: " << clouds);
    return;
  }
  for (const char* pair : {"pine_plot_interleaved", "pine_plot_virtualscans", "dense_conifers_interleaved",
                           "dense_conifers_virtualscans"})
    CHECK_NOTHROW(read_transform(clouds / (std::string(pair) + "_gt.txt")));
}

}  // namespace globalmatch::support::test_transform_files

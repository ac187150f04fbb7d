#include "support/programs/survey_constraints.hpp"

#include <cmath>
#include <iostream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "catch.hpp"

namespace globalmatch::support::test_survey_constraints {

using Catch::Matchers::Contains;

namespace {

/// What a call writes on standard error.
template <class Call>
std::string complaint_of(const Call& call) {
  std::ostringstream text;
  std::streambuf* const before = std::cerr.rdbuf(text.rdbuf());
  call();
  std::cerr.rdbuf(before);
  return std::move(text).str();
}

/// Two scans that were placed, the second with an uncertainty.
struct placed_pair_of_scans {
  survey result;
  survey_work work;
  survey_options options;

  placed_pair_of_scans() {
    result.scans.resize(2);
    result.components = 1;
    result.frames.resize(1);
    result.frames[0].source = survey::frame_source::fixed;
    for (survey::scan& s : result.scans) {
      s.status = survey::status::placed;
      s.component = 0;
      s.uncertainty = transform_uncertainty{{0, 0, 0}, {0, 0, 1}, Eigen::Matrix4d::Zero()};
    }
    result.scans[1].uncertainty->covariance = 1e-4 * Eigen::Matrix4d::Identity();
    work.names = {"first", "second"};
    work.maps.resize(2);
    options.fixed = {{0, Eigen::Isometry3d::Identity()}, {1, Eigen::Isometry3d::Identity()}};
  }
  std::string complaint() const {
    return complaint_of([&] { report_constraints(result, options, work); });
  }
};

}  // namespace

TEST_CASE("a fixed scan that was not held is named, with how far it is off or that it agrees") {
  placed_pair_of_scans scans;
  CHECK_THAT(scans.complaint(), Contains("second: its fixed pose agrees") && !Contains("first"));
  scans.result.scans[1].fixed_distance = 0.25;
  CHECK_THAT(scans.complaint(), Contains("second: its fixed pose is 0.25 m") && !Contains("agrees"));
  scans.work.control = 1;
  CHECK_THAT(scans.complaint(), Contains("second: its frame is 0.25 m"));
  scans.result.scans[1].fixed_distance = std::numeric_limits<double>::quiet_NaN();
  scans.result.scans[1].uncertainty->covariance.setZero();
  CHECK(scans.complaint().empty());
}

TEST_CASE("a level that the survey contradicts is named, and a frame that leans") {
  placed_pair_of_scans scans;
  scans.options.fixed.pop_back();
  scans.options.levels = {{.scan = 1, .sigma = 0.002}};
  CHECK(scans.complaint().empty());
  scans.result.scans[1].survey_from_scan.linear() =
      Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitX()).matrix();
  CHECK_THAT(scans.complaint(), Contains("second: its vertical is 1.1 degrees off"));
  for (survey::scan& s : scans.result.scans)
    s.uncertainty->up = scans.result.scans[1].survey_from_scan.linear().col(2);
  CHECK_THAT(scans.complaint(),
             Contains("component 0: its frame leans by 1.1 degrees") && !Contains("second"));
}

TEST_CASE("priors of scans that there are not are left out, and named") {
  survey_constraints known;
  known.priors.resize(2);
  known.priors[0].scan = "scan_1";
  known.priors[1].scan = "scan_7";
  const std::string complaint = complaint_of([&] {
    known.require_names({{"a/scan_1.ply", "scan_1", ""}, {"a/scan_2.ply", "scan_2", ""}});
  });
  REQUIRE(known.priors.size() == 1);
  CHECK(known.priors[0].scan == "scan_1");
  CHECK_THAT(complaint, Contains("scan_7: no scan of that name") && Contains("is it scan_"));
}

}  // namespace globalmatch::support::test_survey_constraints

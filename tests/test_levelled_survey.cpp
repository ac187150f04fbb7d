#include "globalmatch/detail/survey/levelled_survey.hpp"

#include <cstddef>
#include <span>

#include "catch.hpp"

namespace globalmatch::test_levelled_survey {

using namespace detail;

namespace {

const Eigen::Vector3d leaning = Eigen::Vector3d(0.1, -0.2, 1).normalized();

/// Two scans of a leaning survey, of which the first is held.
survey leaning_survey() {
  survey s;
  s.components = 1;
  for (int m = 0; m < 2; ++m) {
    survey::scan scan;
    scan.component = 0;
    scan.is_height_known = true;
    scan.survey_from_scan.translation() = Eigen::Vector3d(20 * m, 3, 1);
    scan.uncertainty = transform_uncertainty{Eigen::Vector3d(20 * m + 1, 4, 2), leaning,
                                             Eigen::Matrix4d::Identity() * (m == 0 ? 0 : 1e-4)};
    s.scans.push_back(scan);
  }
  return s;
}

}  // namespace

TEST_CASE("scans without variance are held, and a raise goes along the vertical") {
  const survey s = leaning_survey();
  levelled_survey levelled(s);
  CHECK((levelled.plan_held[0] && !levelled.plan_held[1]));
  CHECK((levelled.height_held[0] && !levelled.height_held[1]));
  CHECK(levelled.change_of(1).isApprox(Eigen::Isometry3d::Identity(), 1e-12));
  levelled.raise[1] = 0.5;
  CHECK((levelled.change_of(1) * Eigen::Vector3d(7, 8, 9) - Eigen::Vector3d(7, 8, 9) - 0.5 * leaning).norm() <
        1e-12);
}

TEST_CASE("a pair that moves its source up says so in height, and nothing in plan") {
  const survey s = leaning_survey();
  refined_pair pair;
  pair.start.source = 1;
  pair.start.target = 0;
  pair.target_from_source = s.scans[0].survey_from_scan.inverse() * Eigen::Translation3d(0.3 * leaning) *
                            s.scans[1].survey_from_scan;
  pair.uncertainty = {Eigen::Vector3d(2, 3, 4), leaning, Eigen::Matrix4d::Identity() * 1e-4};
  pair.is_refined = true;
  const levelled_survey levelled(s);
  const levelled_pair found(pair, s, levelled);
  CHECK((found.has_shift && !found.has_height));
  CHECK(found.height.change == Approx(0.3));
  CHECK(link_residual(found.link, levelled.start[1], levelled.start[0]).shift.norm() < 1e-12);
}

TEST_CASE("frames are held in place of scans of their component") {
  survey s = leaning_survey();
  s.scans.push_back(s.scans[1]);  // the frame
  refined_pair pair;
  pair.start.source = 1;
  pair.start.target = 2;
  levelled_survey levelled(s);
  levelled.hold_frames(s, std::span(&pair, 1));
  CHECK(levelled.is_unknown(0, false, true));
  CHECK(levelled.is_unknown(1, true, false));
  CHECK_FALSE(levelled.is_unknown(2, true, false));
}

}  // namespace globalmatch::test_levelled_survey

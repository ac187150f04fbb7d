#include "globalmatch/detail/survey/adjust_to_pairs.hpp"

#include <cstddef>
#include <vector>

#include "catch.hpp"
#include "placed_scans.hpp"

namespace globalmatch::test_adjust_to_pairs {

using namespace detail;

namespace {

/// Scans in a row, of which the first is held; no trees.
survey row_of(std::size_t count) {
  survey s;
  s.components = 1;
  for (std::size_t m = 0; m < count; ++m)
    s.scans.push_back(scenes::placed_scan({20 * double(m), 3, 1}, m == 0 ? 0 : 1e-4));
  return s;
}

/// A pair of neighbors that moves the first one by this.
refined_pair pair_that_moves(const survey& s, std::size_t source, const Eigen::Vector3d& shift) {
  refined_pair pair;
  pair.start.source = source;
  pair.start.target = source - 1;
  pair.target_from_source = s.scans[source - 1].survey_from_scan.inverse() * Eigen::Translation3d(shift) *
                            s.scans[source].survey_from_scan;
  pair.uncertainty = {Eigen::Vector3d(10, 0, 0), Eigen::Vector3d::UnitZ(),
                      Eigen::Matrix4d::Identity() * 1e-6};
  pair.is_refined = pair.is_height_refined = true;
  return pair;
}

}  // namespace

TEST_CASE("shifts of pairs add up along a row, from the held scan on") {
  const survey before = row_of(3);
  survey s = before;
  const Eigen::Vector3d shift(0.02, -0.03, 0.04);
  const std::vector<refined_pair> pairs = {pair_that_moves(s, 1, shift), pair_that_moves(s, 2, shift)};
  const adjusted_parts parts = adjust_to_pairs(s, pairs, {}, prior_use::keep);
  CHECK((parts.shifts && parts.heights));
  for (std::size_t m = 0; m < 3; ++m)
    CHECK((s.scans[m].survey_from_scan.translation() - before.scans[m].survey_from_scan.translation() -
           double(m) * shift)
              .norm() < 1e-6);
}

TEST_CASE("scans that stay where they are have the uncertainty of the adjustment") {
  survey s = row_of(2);
  const std::vector<refined_pair> pairs = {pair_that_moves(s, 1, Eigen::Vector3d::Zero())};
  adjust_to_pairs(s, pairs, {}, prior_use::keep);
  CHECK(s.scans[1].uncertainty->covariance(2, 2) == Approx(1e-6));
  CHECK(s.scans[0].uncertainty->covariance.isZero(0));
}

TEST_CASE("without pairs nothing is adjusted, to the bit") {
  const survey before = row_of(2);
  survey s = before;
  const adjusted_parts parts = adjust_to_pairs(s, {}, {}, prior_use::keep);
  CHECK_FALSE((parts.shifts || parts.heights));
  for (std::size_t m = 0; m < 2; ++m) {
    CHECK(s.scans[m].survey_from_scan.matrix() == before.scans[m].survey_from_scan.matrix());
    CHECK(s.scans[m].uncertainty->covariance == before.scans[m].uncertainty->covariance);
  }
}

}  // namespace globalmatch::test_adjust_to_pairs

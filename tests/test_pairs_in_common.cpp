#include "globalmatch/detail/survey/pairs_in_common.hpp"

#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/disjoint_sets.hpp"

namespace globalmatch::test_pairs_in_common {

using namespace detail;

namespace {

/// Scans along a line, each with ever fewer trees in common with those further away.
survey survey_along_line(std::size_t scans) {
  survey s;
  s.scans.resize(scans);
  for (std::size_t m = 0; m < scans; ++m) {
    survey::scan& scan = s.scans[m];
    scan.status = survey::status::placed;
    scan.component = 0;
    scan.is_height_known = true;
    scan.survey_from_scan =
        Eigen::Translation3d(10.0 * double(m), 0, 0) * Eigen::AngleAxisd(double(m), Eigen::Vector3d::UnitZ());
    scan.uncertainty = transform_uncertainty{scan.survey_from_scan.translation(), {0, 0, 1}, {}};
    scan.uncertainty->covariance = (1e-4 * double(m) * Eigen::Vector4d(1, 1, 4, 0.01)).asDiagonal();
    for (std::size_t k = 0; k < m; ++k)
      for (std::size_t t = m - k; t < 5; ++t) {
        survey::tree tree;
        tree.seen = {{k, t}, {m, t}};
        s.trees.push_back(tree);
      }
  }
  return s;
}

}  // namespace

TEST_CASE("pairs are those of most trees in common, at most so many a scan") {
  const survey s = survey_along_line(30);
  const auto pairs = pairs_in_common(s, 2);
  std::set<std::pair<std::size_t, std::size_t>> distinct;
  for (const pair_to_refine& p : pairs) {
    CHECK(p.source > p.target);
    CHECK(p.source - p.target <= 2);
    distinct.insert({p.source, p.target});
  }
  CHECK(distinct.size() == pairs.size());
  for (std::size_t m = 1; m < 30; ++m) CHECK(distinct.count({m, m - 1}) == 1);
  CHECK(pairs.size() <= 2 * 30);
}

TEST_CASE("pairs connect all scans of a component, be it by a link without trees") {
  survey s = survey_along_line(8);
  std::erase_if(s.trees, [](const survey::tree& t) { return t.seen[0].scan < 4 && t.seen[1].scan >= 4; });
  const auto connects = [&] {
    disjoint_sets sets(8);
    for (const pair_to_refine& p : pairs_in_common(s, 1))
      sets.join(std::uint32_t(p.source), std::uint32_t(p.target));
    return sets.find(0) == sets.find(7);
  };
  CHECK_FALSE(connects());
  s.links.push_back({.source = 2, .target = 6, .used = true});
  CHECK(connects());
}

TEST_CASE("scans without samples are in no pair, and the others have as many as without them") {
  survey s = survey_along_line(8), with_census = s;
  with_census.scans.push_back(s.scans[7]);
  for (survey::tree& t : with_census.trees) t.seen.push_back({8, 0});
  const std::vector<std::size_t> census = {8};
  const auto pairs = pairs_in_common(with_census, 2, census), expected = pairs_in_common(s, 2);
  REQUIRE(pairs.size() == expected.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    CHECK(pairs[i].source == expected[i].source);
    CHECK(pairs[i].target == expected[i].target);
  }
}

TEST_CASE("a pair starts as the survey places it, with the errors of both") {
  const survey s = survey_along_line(3);
  for (const pair_to_refine& p : pairs_in_common(s, 3)) {
    const auto &from = s.scans[p.source], &to = s.scans[p.target];
    CHECK((to.survey_from_scan * p.target_from_source).isApprox(from.survey_from_scan, 1e-12));
    CHECK(p.is_height_known);
    const Eigen::Vector3d place(3, 4, 5);
    const Eigen::Matrix3d turn = to.survey_from_scan.linear(),
                          there = turn * p.uncertainty.at(to.survey_from_scan.inverse() * place) *
                                  turn.transpose();
    CHECK((there - from.uncertainty->at(place) - to.uncertainty->at(place)).norm() < 1e-12);
  }
}

TEST_CASE("a survey of nothing, or of scans that were not placed, has no pairs") {
  CHECK(pairs_in_common({}, 3).empty());
  survey s;
  s.scans.resize(4);
  CHECK(pairs_in_common(s, 3).empty());
}

}  // namespace globalmatch::test_pairs_in_common

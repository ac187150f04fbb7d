#include "globalmatch/detail/survey/prior_tests.hpp"

#include <cmath>
#include <cstddef>

#include "catch.hpp"
#include "placed_scans.hpp"

namespace globalmatch::test_prior_tests {

using namespace detail;

namespace {

/// Scans in a component, at the origin, that `count` priors of 1 cm place there.
survey survey_with_priors(std::size_t count) {
  survey s;
  s.components = 1;
  s.frames.resize(1);
  for (std::size_t m = 0; m < count; ++m) {
    s.scans.push_back(scenes::placed_scan(Eigen::Vector3d::Zero(), 1e-6));
    survey_options::prior given = {.scan = m, .sigma_plan = 0.01, .sigma_height = 0.01};
    given.position = Eigen::Vector3d(0.005 * (m % 2 == 0 ? 1 : -1), 0.004, 0.003);
    s.priors.push_back({given, 1, 0, 1});
  }
  return s;
}

/// An adjustment that does not move scans, as where stems hold them.
const auto rigid_stems = [](survey&) { return adjusted_parts{true, true}; };

}  // namespace

TEST_CASE("of priors that fit all count, and one that is far off in plan counts in height alone") {
  survey s = survey_with_priors(8);
  leave_out_contradicted(s, 0, rigid_stems);
  for (const survey::adjusted_prior& p : s.priors) CHECK((p.weight == 1 && p.height_weight == 1));
  s.priors[3].given.position.x() += 1;
  leave_out_contradicted(s, 0, rigid_stems);
  for (std::size_t i = 0; i < s.priors.size(); ++i) {
    CHECK(s.priors[i].weight == (i == 3 ? 0 : 1));
    CHECK(s.priors[i].height_weight == 1);
  }
}

TEST_CASE("a prior that was left out before counts again where it fits") {
  survey s = survey_with_priors(6);
  s.priors[2].weight = 0;
  leave_out_contradicted(s, 0, rigid_stems);
  CHECK(s.priors[2].weight == 1);
}

TEST_CASE("priors that are all off alike are scaled, and not left out") {
  survey s = survey_with_priors(20);
  for (std::size_t i = 0; i < s.priors.size(); ++i)
    s.priors[i].given.position =
        (0.08 + 0.002 * double(i)) * Eigen::Vector3d(std::sin(double(i)), std::cos(double(i)), 0);
  leave_out_contradicted(s, 0, rigid_stems);
  for (const survey::adjusted_prior& p : s.priors) {
    CHECK(p.weight > 0.005);
    CHECK(p.weight < 0.1);
  }
}

TEST_CASE("the yaw of a frame is known as well as the best scan that a prior places, and else not") {
  survey s = survey_with_priors(4);
  CHECK(leave_out_contradicted(s, 0, rigid_stems) == Approx(1e-3));
  CHECK(std::isinf(leave_out_contradicted(s, 0, [](survey&) { return adjusted_parts{}; })));
}

}  // namespace globalmatch::test_prior_tests

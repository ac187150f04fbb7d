#include "globalmatch/matching_options.hpp"

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "catch.hpp"
#include "support/message_of.hpp"

namespace globalmatch::test_matching_options {

using support::message_of;

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                 infinity = std::numeric_limits<double>::infinity();

/// What is said of options after a change.
template <class Change>
std::string message(const Change& change) {
  matching_options options;
  change(options);
  return message_of([&] { require_valid(options); });
}

}  // namespace

TEST_CASE("the usual matching options are valid, those of the paper have its values") {
  CHECK(message([](matching_options&) {}).empty());
  CHECK(matching_options{}.triangles.neighbors == 20);
  CHECK_FALSE(matching_options{}.dof);
  CHECK_FALSE(matching_options{}.inlier_threshold);
  CHECK(message([](auto& o) { o.inlier_threshold = 0.05; }).empty());
  CHECK(message([](auto& o) { o.dof = degrees_of_freedom::six; }).empty());
  CHECK(message([](auto& o) { o.proposal = proposal::algorithm_1; }).empty());
  CHECK(message([](auto& o) { o.horizontal = true; }).empty());
}

TEST_CASE("matching options that make no sense are refused by name") {
  for (const double bad : {0.0, -0.1, nan}) {
    CHECK(message([&](auto& o) { o.inlier_threshold = bad; }).starts_with("inlier_threshold must"));
    CHECK(message([&](auto& o) { o.decision.max_nfa = bad; }).starts_with("decision.max_nfa must"));
    CHECK(message([&](auto& o) {
            o.decision.alternative_share = bad;
          }).starts_with("decision.alternative_share must"));
  }
  CHECK(message([](auto& o) { o.inlier_threshold = infinity; }).starts_with("inlier_threshold must"));
  CHECK(message([](auto& o) { o.dof = degrees_of_freedom(5); }).starts_with("dof must"));
  CHECK(message([](auto& o) { o.proposal = proposal(7); }).starts_with("proposal must"));
  CHECK(message([](auto& o) {
          o.horizontal = true, o.dof = degrees_of_freedom::six;
        }).starts_with("horizontal:"));
  CHECK(message([](auto& o) { o.triangles.neighbors = 1; }).starts_with("triangles.neighbors must"));
  CHECK(message([](auto& o) { o.global.max_hypotheses = 1; }).starts_with("global.max_hypotheses must"));
}

TEST_CASE("limits of decision options are inclusive where they say so") {
  CHECK(message([](auto& o) { o.decision.min_correspondences = 3; }).empty());
  CHECK(message([](auto& o) {
          o.decision.min_correspondences = 2;
        }).starts_with("decision.min_correspondences"));
  CHECK(message([](auto& o) { o.decision.min_minor_axis_sigma = 0; }).empty());
  for (const double bad : {-1e-9, nan}) {
    CHECK(message([&](auto& o) {
            o.decision.min_minor_axis_sigma = bad;
          }).starts_with("decision.min_minor_axis_sigma"));
  }
  CHECK(message([](auto& o) { o.decision.alternative_share = 1; }).empty());
  CHECK(message([](auto& o) {
          o.decision.alternative_share = 1.001;
        }).starts_with("decision.alternative_share"));
}

}  // namespace globalmatch::test_matching_options

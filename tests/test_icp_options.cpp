#include "globalmatch/icp_options.hpp"

#include <limits>
#include <string>

#include "catch.hpp"
#include "support/message_of.hpp"

namespace globalmatch::test_icp_options {

namespace {

template <class Value>
std::string message(Value icp_options::*field, Value value) {
  icp_options options;
  options.*field = value;
  return support::message_of([&] { require_valid(options); });
}

}  // namespace

TEST_CASE("icp options that make no sense are named") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {0.0, -1.0, nan}) {
    CHECK_THAT(message(&icp_options::max_distance, bad), Catch::Contains("icp.max_distance"));
    CHECK_THAT(message(&icp_options::trimming, bad), Catch::Contains("icp.trimming"));
    CHECK_THAT(message(&icp_options::convergence_threshold, bad),
               Catch::Contains("icp.convergence_threshold"));
  }
  CHECK_THAT(message(&icp_options::max_iterations, 0), Catch::Contains("icp.max_iterations"));
  CHECK_THAT(message(&icp_options::max_points, std::size_t(5)), Catch::Contains("icp.max_points"));
  CHECK_THAT(message(&icp_options::plane_neighbors, 2), Catch::Contains("icp.plane_neighbors"));
  CHECK_THAT(message(&icp_options::metric, static_cast<icp_metric>(9)), Catch::Contains("icp.metric"));
}

TEST_CASE("the smallest icp options that make sense are taken, and so are the default ones") {
  CHECK_NOTHROW(require_valid(icp_options{}));
  CHECK_NOTHROW(require_valid(icp_options{.metric = icp_metric::none,
                                          .max_distance = 1e-9,
                                          .trimming = 1e-9,
                                          .max_iterations = 1,
                                          .convergence_threshold = 1e-12,
                                          .max_points = 6,
                                          .plane_neighbors = 3}));
}

}  // namespace globalmatch::test_icp_options

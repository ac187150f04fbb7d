#include "globalmatch/registration_options.hpp"

#include "catch.hpp"

namespace globalmatch::test_registration_options {

TEST_CASE("paper_options holds the values of the paper") {
  const registration_options options = paper_options();
  CHECK(options.mapping.understory.min_height == 0.2);
  CHECK(options.mapping.understory.max_height == 3.0);
  CHECK(options.mapping.ground.filter == ground_filter::cloth);
  CHECK(options.mapping.rule == stem_point_rule::points);
  CHECK(options.mapping.vertical == vertical_rule::given);
  CHECK(options.mapping.voxel_size == 0.01);
  CHECK(options.mapping.verticality.radius == 0.10);
  CHECK(options.mapping.verticality.threshold == 0.9);
  CHECK_FALSE(options.mapping.stems.cylinder.usual_taper);
  CHECK(options.mapping.min_quality == 0);
  CHECK(options.matching.triangles.neighbors == 20);
  CHECK(options.matching.inlier_threshold == 0.05);
  CHECK(options.matching.dof == degrees_of_freedom::four);
  CHECK_FALSE(options.matching.horizontal);
  CHECK(options.icp.metric == icp_metric::point_to_point);
  CHECK_NOTHROW(require_valid(options.mapping));
  CHECK_NOTHROW(require_valid(options.matching));
  CHECK_NOTHROW(require_valid(options.icp));
}

}  // namespace globalmatch::test_registration_options

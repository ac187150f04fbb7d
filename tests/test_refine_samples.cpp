#include "globalmatch/icp.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"
#include "support/message_of.hpp"

// The function that detail/icp/refine_samples.hpp defines, where the headers declare it: in both modes.
namespace globalmatch::test_refine_samples {

using namespace detail;

namespace {

using scenes::four;

/// Rolling ground, and the same a little aside.
icp_samples rolling_ground(const vec3& shift) {
  icp_samples samples;
  for (int i = 0; i < 40; ++i)
    for (int j = 0; j < 40; ++j) {
      const double x = 0.1 * i, y = 0.1 * j;
      samples.source.push_back({x, y, 0.4 * std::sin(2 * x) + 0.3 * std::cos(3 * y)});
      samples.target.push_back(samples.source.back() + shift);
    }
  return samples;
}

}  // namespace

TEST_CASE("layers that lack samples of a scan count for nothing") {
  const vec3 shift{0.03, -0.02, 0.01};
  const icp_samples ground = rolling_ground(shift);
  icp_samples source_only, target_only;
  source_only.source = target_only.target = ground.target;
  const icp_result alone = refine_samples({ground}, rigid::identity(), four, {}, {}),
                   among_others =
                       refine_samples({source_only, ground, target_only}, rigid::identity(), four, {}, {});
  CHECK(alone.converged);
  CHECK(scenes::max_error(alone.target_from_source, Eigen::Isometry3d(Eigen::Translation3d(to_eigen(shift))),
                          scenes::to_positions(ground.source)) < 1e-3);
  CHECK(among_others.target_from_source.matrix() == alone.target_from_source.matrix());
  CHECK(among_others.pairs == alone.pairs);
}

TEST_CASE("without a metric, or without samples, the coarse transform comes back and has not converged") {
  const rigid coarse{rotation_about_z(0.3), {1, -2, 0.5}};
  const Eigen::Matrix4d expected = to_eigen(coarse).matrix();
  for (const icp_result& result :
       {refine_samples({rolling_ground({})}, coarse, four, {.metric = icp_metric::none}, {}),
        refine_samples({}, coarse, four, {}, {}), refine_samples({{}, {}}, coarse, four, {}, {})}) {
    CHECK(result.target_from_source.matrix() == expected);
    CHECK_FALSE(result.converged);
    CHECK(result.iterations == 0);
  }
}

TEST_CASE("a bad option and a coarse transform that is not finite are named, also without samples") {
  const auto message = [](const rigid& coarse, const icp_options& options) {
    return support::message_of([&] { refine_samples({}, coarse, four, options, {}); });
  };
  rigid not_finite = rigid::identity();
  not_finite.translation.y = std::numeric_limits<double>::quiet_NaN();
  CHECK(message(not_finite, {}) == "coarse must be finite");
  CHECK(message(rigid::identity(), {.trimming = 0}) == "icp.trimming must be positive");
}

}  // namespace globalmatch::test_refine_samples

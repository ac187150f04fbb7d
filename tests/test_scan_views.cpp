#include "globalmatch/detail/matching/scan_views.hpp"

#include "catch.hpp"
#include "globalmatch/registration.hpp"
#include "seen_forest.hpp"

namespace globalmatch::test_scan_views {

using namespace detail;

using scenes::station;

TEST_CASE("views of maps that are exchanged are exchanged") {
  const stem_map first, second;
  const scan_views views = {{&first.visible, &first.terrain}, {&second.visible, &second.terrain}};
  const scan_views reversed = views.reversed();
  CHECK(reversed.source.visible == &second.visible);
  CHECK(reversed.source.ground == &second.terrain);
  CHECK(reversed.target.visible == &first.visible);
  CHECK(reversed.target.ground == &first.terrain);
}

TEST_CASE("each scanner is asked about the stems of the other scan, whichever map is the larger one") {
  std::size_t larger_sources = 0, larger_targets = 0;
  for (std::uint64_t seed = 10; seed < 16; ++seed) {
    random_source random(seed);
    const auto trunks = scenes::random_trunks(random, 220, 60);
    station first(trunks, {-6, 1}, 0.4, random);
    const station second(trunks, {7, -2}, -1.9, random);
    first.keep_common(trunks, second, 5);
    const Eigen::Isometry3d truth = second.forest_from_scan.inverse() * first.forest_from_scan;
    const auto check = [&](const stem_map& source, const stem_map& target,
                           const Eigen::Isometry3d& expected) {
      (source.stems.size() > target.stems.size() ? larger_sources : larger_targets) += 1;
      const registration result = register_maps(source, target, scenes::with_icp(icp_metric::none));
      REQUIRE(result.target_from_source);
      CHECK(scenes::max_error(*result.target_from_source, expected, {Eigen::Vector3d(5, 0, 0)}) < 0.5);
    };
    check(first.map, second.map, truth);
    check(second.map, first.map, truth.inverse());
  }
  CHECK(larger_sources > 0);
  CHECK(larger_targets > 0);
}

}  // namespace globalmatch::test_scan_views

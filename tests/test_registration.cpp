#include "globalmatch/registration.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <tuple>

#include "catch.hpp"
#include "globalmatch/evaluation.hpp"
#include "globalmatch/globalmatch.hpp"
#include "made_up_maps.hpp"
#include "support/scan_files.hpp"
#include "support/transform_files.hpp"

namespace globalmatch::test_registration {

using namespace detail;

using scenes::positions;

namespace {

using scenes::made_up_map;

/// Three thousand points of level ground and six stems.
positions small_scan() {
  random_source random(5);
  positions points;
  for (int i = 0; i < 2000; ++i)
    points.push_back(
        {scenes::uniform(random, 0, 10), scenes::uniform(random, 0, 10), 0.005 * random.normal()});
  for (int stem = 0; stem < 6; ++stem) {
    const double x = scenes::uniform(random, 1, 9), y = scenes::uniform(random, 1, 9);
    for (int i = 0; i < 400; ++i) {
      const double angle = 6.28 * random.uniform();
      points.push_back({x + 0.1 * std::cos(angle), y + 0.1 * std::sin(angle), 3 * random.uniform()});
    }
  }
  return points;
}

}  // namespace

TEST_CASE("register_scans of scans without points, stems or numbers is not_registered, never an exception") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const positions none, one = {{1, 2, 3}}, no_numbers(50, Eigen::Vector3d(nan, nan, nan)),
                        pile(50, Eigen::Vector3d(1, 2, 3));
  for (const positions& scan : {none, one, no_numbers, pile}) {
    const scan_registration result = register_scans(scan, scan);
    CHECK(result.registration.outcome == outcome::not_registered);
    CHECK_FALSE(result.registration.reason.empty());
    CHECK_FALSE(result.registration.target_from_source);
    CHECK(result.source.stems.empty());
  }
}

TEST_CASE("register_maps of flat maps in six degrees of freedom is not_registered, with the remedy") {
  const positions level = {{0, 0, 2}, {4, 0, 2}, {1, 5, 2}, {8, 8, 2}, {2, 9, 2}, {12, 3, 2}, {6, 13, 2}};
  positions uneven = level;
  for (Eigen::Vector3d& p : uneven) p.z() += 0.2 * std::sin(p.x());
  registration_options options;
  options.matching.dof = degrees_of_freedom::six;
  const stem_map flat = made_up_map(level), rolling = made_up_map(uneven);
  for (const auto& [source, target, name] :
       {std::tuple(flat, flat, "source"), std::tuple(flat, rolling, "source"),
        std::tuple(rolling, flat, "target")}) {
    const registration result = register_maps(source, target, options);
    CHECK(result.outcome == outcome::not_registered);
    CHECK_FALSE(result.target_from_source);
    CHECK_THAT(result.reason, Catch::StartsWith(name) && Catch::Contains("heights that differ"));
  }
  options.matching.dof = degrees_of_freedom::four;
  CHECK(register_maps(flat, flat, options).outcome == outcome::registered);
}

TEST_CASE("register_maps and register_scans are cancelled by the progress callback in every stage") {
  const positions scan = small_scan();
  const stem_map map =
      made_up_map({{0, 0, 0}, {4, 0, 0}, {1, 5, 0}, {8, 8, 0}, {2, 9, 0}, {12, 3, 0}, {6, 13, 0}});
  std::vector<std::string> stages;
  // Work between two loops may report an earlier stage again, where it takes long.
  const auto noting = [&](const progress& p) {
    if (std::find(stages.begin(), stages.end(), p.stage) == stages.end()) stages.emplace_back(p.stage);
    return true;
  };
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  register_scans(scan, scan, {}, up, {.threads = 1, .on_progress = noting});
  const auto scan_stages = std::exchange(stages, {});
  CHECK(scan_stages.size() > 4);
  register_maps(map, map, {}, {.threads = 1, .on_progress = noting});
  CHECK(stages.back() == "icp");

  for (const std::string& last : scan_stages) {
    INFO("stage " << last);
    const auto cancel = [&](const progress& p) { return p.stage != last; };
    const auto result = register_scans(scan, scan, {}, up, {.threads = 1, .on_progress = cancel});
    CHECK(result.registration.outcome == outcome::cancelled);
    CHECK_FALSE(result.registration.reason.empty());
    CHECK_FALSE(result.registration.target_from_source);
  }
  for (const std::string& last : stages) {
    INFO("stage " << last);
    const auto cancel = [&](const progress& p) { return p.stage != last; };
    const auto result = register_maps(map, map, {}, {.threads = 1, .on_progress = cancel});
    CHECK(result.outcome == outcome::cancelled);
    CHECK_FALSE(result.target_from_source);
  }
}

TEST_CASE("register_scans names the option that makes no sense before it maps anything") {
  const positions scan = small_scan();
  bool mapped = false;
  const execution exec{.threads = 1, .on_progress = [&](const progress&) {
                         mapped = true;
                         return true;
                       }};
  registration_options bad_mapping, bad_matching, bad_icp, with_scale;
  bad_mapping.mapping.voxel_size = -1;
  bad_matching.matching.inlier_threshold = 0;
  bad_icp.icp.trimming = -1;
  with_scale.matching.scale = true;
  for (const auto& [options, field] :
       {std::pair(bad_mapping, "voxel_size"), std::pair(bad_matching, "inlier_threshold"),
        std::pair(bad_icp, "trimming"), std::pair(with_scale, "scale")})
    CHECK_THROWS_WITH(register_scans(scan, scan, options, Eigen::Vector3d::UnitZ(), exec),
                      Catch::Contains(field));
  CHECK_THROWS_WITH(register_scans(scan, scan, {}, Eigen::Vector3d(0, 0, 0), exec), Catch::Contains("up"));
  CHECK_FALSE(mapped);
}

TEST_CASE("register_scans registers the real clouds, 10 cm coarse and 3 cm fine", "[slow]") {
  const std::filesystem::path folder = std::filesystem::path(GLOBALMATCH_SHARED_DATA) / "clouds";
  if (!std::filesystem::exists(folder)) {
    WARN("skipped: there is no " << folder.string());
    return;
  }
  for (const std::string pair : {"pine_plot_interleaved", "pine_plot_virtualscans",
                                 "dense_conifers_interleaved", "dense_conifers_virtualscans"}) {
    INFO(pair);
    const auto source = support::open_scan(folder / (pair + "_src.ply"));
    const auto target = support::open_scan(folder / (pair + "_tgt.ply"));
    const auto truth = support::read_transform(folder / (pair + "_gt.txt"));
    const auto result = register_scans(source, target);
    INFO(result.registration.reason);
    REQUIRE(result.registration.outcome == outcome::registered);
    const auto& fine = *result.registration.target_from_source;
    const auto& coarse = *result.registration.matching.target_from_source;
    CHECK(evaluate_registration(coarse, truth, source).pointwise <= 0.10);
    CHECK(evaluate_registration(fine, truth, source).pointwise <= 0.03);
  }
}

}  // namespace globalmatch::test_registration

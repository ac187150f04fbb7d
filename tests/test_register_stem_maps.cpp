#include "globalmatch/registration.hpp"

#include <cmath>
#include <utility>

#include "catch.hpp"
#include "globalmatch/detail/core/local_frame.hpp"
#include "made_up_maps.hpp"

// The function that detail/verbs/register_stem_maps.hpp defines, by the verb that calls it: in both modes.
namespace globalmatch::test_register_stem_maps {

using namespace detail;

namespace {

using scenes::made_up_map;
using scenes::positions;
using scenes::with_icp;

}  // namespace

TEST_CASE("register_maps registers the source to the target, refined unless icp is off") {
  random_source random(1);
  auto [stems, truth, source, target] = scenes::two_maps_of_a_stand(random);
  for (stem& s : target.stems) s.position += 0.01 * Eigen::Vector3d(random.normal(), random.normal(), 0);

  const registration coarse = register_maps(source, target, with_icp(icp_metric::none));
  REQUIRE(coarse.outcome == outcome::registered);
  CHECK_FALSE(coarse.icp);
  CHECK(coarse.target_from_source->matrix() == coarse.matching.target_from_source->matrix());
  const double coarse_error = scenes::max_error(*coarse.target_from_source, truth, stems);
  CHECK(coarse_error < 0.05);
  CHECK(coarse_error > 0.001);

  for (const auto metric : {icp_metric::point_to_point, icp_metric::point_to_plane}) {
    const registration fine = register_maps(source, target, with_icp(metric));
    REQUIRE(fine.outcome == outcome::registered);
    CHECK(fine.reason.empty());
    REQUIRE(fine.icp);
    CHECK(fine.icp->converged);
    CHECK(scenes::max_error(*fine.target_from_source, truth, stems) < 0.001);
    CHECK(fine.matching.target_from_source->matrix() == coarse.target_from_source->matrix());
  }
}

TEST_CASE("register_maps refines about the ups of the two maps, which may differ") {
  random_source random(2);
  const positions stems = scenes::random_stems(random, 25, 25, 25);
  const Eigen::Isometry3d yaw = scenes::random_levelled_transform(random);
  const Eigen::Isometry3d tilt(Eigen::AngleAxisd(0.5, Eigen::Vector3d(1, 2, 0).normalized()));
  const Eigen::Isometry3d truth = tilt * yaw;
  const stem_map source = made_up_map(stems);
  stem_map target = made_up_map(scenes::moved(truth, stems));
  target.up = tilt.linear() * Eigen::Vector3d::UnitZ();
  target.terrain.frame.rotation = levelling_rotation(from_eigen(target.up));
  target.stem_samples = scenes::moved(truth, source.stem_samples);
  target.ground_samples = scenes::moved(truth, source.ground_samples);
  for (const auto metric : {icp_metric::none, icp_metric::point_to_point, icp_metric::point_to_plane}) {
    const registration result = register_maps(source, target, with_icp(metric));
    REQUIRE(result.outcome == outcome::registered);
    CHECK(scenes::max_error(*result.target_from_source, truth, stems) < 1e-6);
  }
}

TEST_CASE("the height is that of the ground that both scans see, whatever the heights of the stems") {
  random_source random(21);
  auto [stems, truth, source, target] = scenes::two_maps_of_a_stand(random);
  for (stem& s : target.stems) s.position.z() += 0.6;  // of ground that shrubs hide
  for (const Eigen::Vector3d& up : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 0.1, 1).normalized()}) {
    const Eigen::Isometry3d turned(Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), up));
    stem_map turned_target = target;
    turned_target.up = up;
    turned_target.terrain.frame.rotation = levelling_rotation(from_eigen(up));
    turned_target.ground_samples = scenes::moved(turned, target.ground_samples);
    for (stem& s : turned_target.stems) s.position = turned * s.position;
    const registration result = register_maps(source, turned_target, with_icp(icp_metric::none));
    REQUIRE(result.outcome == outcome::registered);
    CHECK(result.matching.vertical->source == vertical_source::ground);
    CHECK(result.matching.vertical->sigma < 0.01);
    CHECK(scenes::max_error(*result.target_from_source, turned * truth, source.ground_samples) < 0.01);
    const Eigen::Isometry3d best = result.matching.hypotheses.front().target_from_source;
    CHECK(scenes::max_error(best, *result.target_from_source, stems) < 1e-9);
    REQUIRE(result.matching.uncertainty);
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& p : stems) center += best * p / double(stems.size());
    CHECK((result.matching.uncertainty->center - center).norm() < 0.01);
  }
}

TEST_CASE("icp leaves a height that is not known as it was") {
  random_source random(22);
  auto [stems, truth, source, target] = scenes::two_maps_of_a_stand(random);
  for (Eigen::Vector3d& p : target.stem_samples) p += Eigen::Vector3d(0.004, 0, 0.012);
  source.terrain.status = ground_status::none;
  const registration coarse = register_maps(source, target, with_icp(icp_metric::none)),
                     fine = register_maps(source, target, with_icp(icp_metric::point_to_point));
  REQUIRE(fine.outcome == outcome::registered);
  CHECK_FALSE(fine.matching.vertical->is_known());
  REQUIRE(fine.icp);
  const Eigen::Vector3d center = fine.matching.uncertainty->center,
                        moved = fine.icp->target_from_source * coarse.target_from_source->inverse() * center;
  CHECK(moved.x() - center.x() == Approx(0.004).margin(0.001));
  CHECK(moved.z() == Approx(center.z()).margin(1e-9));
}

TEST_CASE("where a vertical is that of the stems the fine registration turns freely") {
  random_source random(13);
  const positions stems = scenes::random_stems(random, 25, 25, 25);
  const Eigen::Isometry3d truth(Eigen::AngleAxisd(0.004, Eigen::Vector3d(1, 2, 0).normalized()));
  const stem_map source = made_up_map(stems);
  stem_map target = made_up_map(scenes::moved(truth, stems));
  target.stem_samples = scenes::moved(truth, source.stem_samples);
  target.ground_samples = scenes::moved(truth, source.ground_samples);
  const auto error = [&] {
    const registration result = register_maps(source, target);
    REQUIRE(result.outcome == outcome::registered);
    return scenes::max_error(*result.target_from_source, truth, stems);
  };
  CHECK(error() > 0.01);
  target.up_by_stems = true;
  CHECK(error() < 1e-4);
}

TEST_CASE("a registration that fails with four degrees of freedom says which scan was not level") {
  random_source random(12);
  stem_map source = made_up_map(scenes::random_stems(random, 25, 25, 25));
  const stem_map target = made_up_map(scenes::random_stems(random, 25, 25, 25));
  source.upright = {Eigen::Vector3d(std::sin(0.14), 0, std::cos(0.14)), 0.002};
  registration_options options;
  options.matching.dof = degrees_of_freedom::four;
  const registration four = register_maps(source, target, options);
  CHECK(four.outcome == outcome::not_registered);
  CHECK(four.reason.find(". The stems of source stand 8.0 degrees off") != std::string::npos);
  CHECK(four.reason.find("The stems of target") == std::string::npos);
  options.matching.dof = degrees_of_freedom::six;
  CHECK(register_maps(source, target, options).reason.find("The stems of") == std::string::npos);
}

TEST_CASE("register_maps distinguishes places of perfect rows by the radii of mapped stems") {
  random_source random(1);
  const positions stems = scenes::lattice(9, 8, 3);
  const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
  const positions seen = scenes::noisy(stems, 0.01, random);
  stem_map source = made_up_map(seen),
           target = made_up_map(scenes::moved(truth, scenes::noisy(stems, 0.01, random)));
  const registration_options coarse = with_icp(icp_metric::none);
  CHECK(register_maps(source, target, coarse).outcome == outcome::ambiguous);
  for (std::size_t i = 0; i < stems.size(); ++i) {
    const double radius = 0.15 + 0.02 * random.normal();
    for (stem_map* map : {&source, &target}) map->stems[i].radius = radius + 0.003 * random.normal();
  }
  const registration result = register_maps(source, target, coarse);
  REQUIRE(result.target_from_source);
  CHECK(scenes::max_error(*result.target_from_source, truth, seen) < 0.05);
  CHECK(result.matching.hypotheses.front().evidence == evidence_source::radii);
}

TEST_CASE("icp that does not converge leaves the coarse transform") {
  random_source random(3);
  const positions stems = scenes::random_stems(random, 25, 25, 25);
  stem_map source = made_up_map(stems);
  source.stem_samples.clear();
  source.ground_samples.clear();
  const registration result = register_maps(source, made_up_map(stems));
  REQUIRE(result.outcome == outcome::registered);
  REQUIRE(result.icp);
  CHECK_FALSE(result.icp->converged);
  CHECK(result.target_from_source->matrix() == result.matching.target_from_source->matrix());
}

TEST_CASE("register_maps of maps without stems is not_registered with a reason and no transform") {
  const stem_map none, some = made_up_map({{0, 0, 0}, {4, 0, 0}, {1, 5, 0}, {8, 8, 0}, {2, 9, 0}});
  for (const auto& [source, target] :
       {std::pair(&none, &none), std::pair(&none, &some), std::pair(&some, &none)}) {
    const registration result = register_maps(*source, *target);
    CHECK(result.outcome == outcome::not_registered);
    CHECK_THAT(result.reason, Catch::Contains("0 stems"));
    CHECK_FALSE(result.target_from_source);
    CHECK_FALSE(result.icp);
  }
}

}  // namespace globalmatch::test_register_stem_maps

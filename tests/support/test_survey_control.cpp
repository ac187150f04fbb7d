#include "support/programs/survey_control.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::support::test_survey_control {

using detail::random_source;

namespace {

/// A survey of `scans` scans at one place, each of which sees all of 30 trees, to 1 cm, and a control of
/// these trees and ten others, in which distances are so many times theirs.
struct controlled_survey {
  survey result;
  survey_work work;

  controlled_survey(std::size_t scans, double scale, double control_noise, std::uint64_t seed) {
    constexpr std::size_t common = 30, all = 40;
    random_source random(seed);
    std::vector<Eigen::Vector3d> trees;
    for (std::size_t t = 0; t < all; ++t)
      trees.push_back({40 * random.uniform() - 20, 40 * random.uniform() - 20, 0});
    work.maps.resize(scans + 1);
    work.control = scans;
    result.scans.resize(scans + 1);
    result.components = 1;
    result.frames.resize(1);
    result.trees.resize(all);
    for (std::size_t m = 0; m <= scans; ++m) {
      result.scans[m].status = survey::status::placed;
      result.scans[m].component = 0;
      result.scans[m].is_height_known = true;
      const double noise = m == scans ? control_noise : 0.01, factor = m == scans ? scale : 1;
      for (std::size_t t = 0; t < (m == scans ? all : common); ++t) {
        stem s;
        s.position = factor * trees[t] + noise * Eigen::Vector3d(random.normal(), random.normal(), 0);
        result.trees[t].seen.push_back({m, work.maps[m].stems.size()});
        work.maps[m].stems.push_back(s);
      }
    }
  }
};

}  // namespace

TEST_CASE("the scale of a control is found within its sigma, whatever repeats its errors") {
  for (const double noise : {0.0, 0.1}) {
    double squares = 0;
    constexpr int surveys = 100;
    for (int seed = 1; seed <= surveys; ++seed) {
      const controlled_survey scene(4, 0.9996, noise, std::uint64_t(seed));
      const auto scale = scale_of_control(scene.result, scene.work);
      REQUIRE(scale);
      CHECK(scale->links == 4);
      CHECK(scale->trees == 30);
      squares += std::pow((scale->factor - 0.9996) / scale->sigma, 2);
    }
    INFO("noise " << noise);
    CHECK(std::sqrt(squares / surveys) > 0.4);
    CHECK(std::sqrt(squares / surveys) < 1.2);
  }
}

TEST_CASE("a scale differs beyond three sigmas and beyond a tenth of a thousandth") {
  CHECK(control_scale{.factor = 0.9996, .sigma = 1e-4}.differs());
  CHECK_FALSE(control_scale{.factor = 0.9996, .sigma = 2e-4}.differs());
  CHECK_FALSE(control_scale{.factor = 1.00008, .sigma = 1e-5}.differs());
}

TEST_CASE("trees that the control alone holds are left out, and its component where it is alone") {
  controlled_survey scene(2, 1, 0.01, 1);
  leave_out_unseen_control(scene.result, scene.work);
  CHECK(scene.result.trees.size() == 30);
  CHECK(scene.result.components == 1);
  scene.result.components = 2;
  scene.result.frames.resize(2);
  scene.result.trees.clear();
  scene.result.scans[2].component = 1;
  scene.result.scans[2].status = survey::status::placed_alone;
  leave_out_unseen_control(scene.result, scene.work);
  CHECK(scene.result.components == 1);
  CHECK(scene.result.frames.size() == 1);
  CHECK(scene.result.scans[2].component == -1);
  CHECK_FALSE(scale_of_control(scene.result, scene.work));
}

}  // namespace globalmatch::support::test_survey_control

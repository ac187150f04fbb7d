#include "globalmatch/significance.hpp"

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch {

using scenes::positions;

namespace {

constexpr auto four = degrees_of_freedom::four;

}  // namespace

TEST_CASE("the chance of meeting a stem is what random stems show") {
  random_source random(1);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 900, 100, 100));
  const map_pair maps(stems, stems, true, four);
  const chance by_chance(maps);
  for (const double tolerance : {0.1, 0.3, 1.0}) {
    int met = 0;
    constexpr int tries = 20000;
    for (int i = 0; i < tries; ++i) {
      bool meets = false;
      maps.for_each_met({scenes::uniform(random, 5, 95), scenes::uniform(random, 5, 95), 0}, tolerance,
                        [&](stem_index, double) { meets = true; });
      met += meets;
    }
    CAPTURE(tolerance);
    const double seen = double(met) / tries;
    CHECK(by_chance.of_meeting(tolerance) > 0.8 * seen);  // stems see more of others than random places do
    CHECK(by_chance.of_meeting(tolerance) < 1.6 * seen);
  }
}

TEST_CASE("unrelated maps rarely pair as many stems as one false alarm in a thousand would take") {
  int alarms = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    random_source random(seed);
    const position_set source = scenes::set_in_order(scenes::random_stems(random, 60, 26, 26));
    const position_set target = scenes::set_in_order(scenes::random_stems(random, 60, 26, 26));
    const map_pair maps(source, target, true, four);
    const chance by_chance(maps);
    // the best of many motions, those that lay one pair of stems on another
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 300; ++i) {
      const std::vector<correspondence> start = {{random.below(60), random.below(60)},
                                                 {random.below(60), random.below(60)}};
      const auto motion = maps.fit(start);
      if (!motion) continue;
      hypothesis h;
      h.target_from_source = *motion;
      weigh(h, maps, by_chance, std::vector{0.05, 0.1, 0.2, 0.4});
      best = std::min(best, h.log10_false_alarms);
    }
    alarms += best < -3;
  }
  CHECK(alarms == 0);
}

TEST_CASE("weighing finds the tolerance of the noise, and the pairs stand at it") {
  for (const double sigma : {0.01, 0.03, 0.1}) {
    random_source random(5);
    const positions stems = scenes::random_stems(random, 150, 40, 40);
    const position_set source = scenes::set_in_order(stems);
    const position_set target = scenes::set_in_order(scenes::noisy(stems, sigma, random));
    const map_pair maps(source, target, true, four);
    hypothesis h;
    const std::vector<double> tolerances = {0.02, 0.028, 0.04, 0.057, 0.08, 0.113, 0.16, 0.226, 0.32, 0.45};
    weigh(h, maps, chance(maps), tolerances);
    CAPTURE(sigma);
    CHECK(h.tolerance > 1.5 * sigma);
    CHECK(h.tolerance < 5 * sigma);
    CHECK(h.log10_false_alarms < -50);
    CHECK(h.correspondences == maps.pair_stems(h.target_from_source, h.tolerance));
    CHECK(h.rms < h.tolerance);
  }
}

TEST_CASE("chance explains everything in maps of fewer than three stems") {
  random_source random(1);
  for (const std::size_t count : {0u, 1u, 2u}) {
    const position_set few = scenes::set_in_order(scenes::random_stems(random, count, 10, 10));
    const map_pair maps(few, few, false, four);
    CHECK(chance(maps).of_meeting(0.05) == 1);
    CHECK(chance(maps).log10_false_alarms(double(count), double(count), 0.05) >= 0);
  }
}

}  // namespace globalmatch

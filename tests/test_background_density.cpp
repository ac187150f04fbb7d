#include "globalmatch/detail/matching/background_density.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"
#include "uneven_stems.hpp"

namespace globalmatch::test_background_density {

using namespace detail;

using scenes::uneven_stems;

using scenes::positions;

namespace {

background_density background_of(const position_set& stems) {
  return background_density(stems, std::make_shared<position_index>(stems));
}

background_density background_of(const positions& stems) {
  return background_of(scenes::set_in_order(stems));
}

/// Share of random places in the middle of a map that lie within `inlier_threshold` [m] of a stem.
double share_near_stems(const position_set& stems, double side, double inlier_threshold,
                        random_source& random) {
  const position_index index(stems);
  constexpr int tries = 20000;
  int met = 0;
  for (int i = 0; i < tries; ++i)
    met += index.any_within(scenes::uniform(random, 5, side - 5), scenes::uniform(random, 5, side - 5),
                            inlier_threshold);
  return double(met) / tries;
}

}  // namespace

TEST_CASE("among random stems the probability of an inlier is the share of places near a stem") {
  random_source random(1);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 900, 100, 100));
  const background_density background = background_of(stems);
  for (const double inlier_threshold : {0.1, 0.3, 1.0}) {
    CAPTURE(inlier_threshold);
    const double seen = share_near_stems(stems, 100, inlier_threshold, random);
    CHECK(background.inlier_probability(inlier_threshold) >
          0.8 * seen);  // stems see more of others than random places do
    CHECK(background.inlier_probability(inlier_threshold) < 1.6 * seen);
  }
}

TEST_CASE("rows have far more inliers among each other than random stems as dense, at centimetres as well") {
  random_source random(2);
  for (const int side : {5, 7, 20}) {
    CAPTURE(side);
    const background_density rows = background_of(scenes::noisy(scenes::lattice(side, side, 3), 0.1, random));
    for (const double inlier_threshold : {0.02, 0.05, 0.1}) {
      CAPTURE(inlier_threshold);
      const double of_random = std::numbers::pi * inlier_threshold * inlier_threshold / 9;
      CHECK(rows.inlier_probability(inlier_threshold) > 4 * of_random);
    }
  }
}

TEST_CASE("clumps are not taken for rows") {
  int taken = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    random_source random(seed);
    positions stems;
    for (const Eigen::Vector3d& center : scenes::random_stems(random, 4, 20, 20))
      for (int i = 0; i < 12; ++i)
        stems.push_back(center + Eigen::Vector3d(1.5 * random.normal(), 1.5 * random.normal(), 0));
    for (const Eigen::Vector3d& between : scenes::random_stems(random, 12, 20, 20)) stems.push_back(between);
    taken += background_of(stems).lattice_inlier_probability(0.3) > 0;
  }
  CHECK(taken <= 1);
}

TEST_CASE("the lattice of perfect rows is known at once") {
  const background_density rows = background_of(scenes::lattice(12, 12, 3));
  CHECK(rows.inlier_probability(0.05) > 0.7);
}

TEST_CASE("the inlier probability grows with the threshold, and is a probability") {
  random_source random(3);
  for (const positions& stems : {scenes::random_stems(random, 200, 50, 50), scenes::lattice(10, 10, 3),
                                 scenes::noisy(scenes::lattice(10, 10, 3), 0.1, random)}) {
    const background_density background = background_of(stems);
    double before = 0;
    for (const double inlier_threshold : {0.02, 0.04, 0.08, 0.16, 0.32, 0.64}) {
      const double p = background.inlier_probability(inlier_threshold);
      CHECK(p >= before);
      CHECK(p <= 1);
      before = p;
    }
  }
}

TEST_CASE("the extent leaves outliers out, and a stem has the area to itself that the density gives") {
  random_source random(4);
  positions stems = scenes::random_stems(random, 400, 60, 40);
  stems.push_back({1e9, -1e9, 0});
  const background_density background = background_of(stems);
  CHECK(background.extent() == Approx(60).epsilon(0.1));
  CHECK(background.stem_radius() == Approx(std::sqrt(60 * 40 / (400 * std::numbers::pi))).epsilon(0.15));
}

TEST_CASE("stems surround places inside a stand, and not those far away") {
  random_source random(5);
  const background_density background = background_of(scenes::random_stems(random, 400, 60, 60));
  CHECK(background.surrounds({30, 30, 100}));
  CHECK_FALSE(background.surrounds({120, 30, 0}));
}

TEST_CASE("in maps of fewer than three stems every stem is an inlier") {
  random_source random(6);
  for (const std::size_t count : {0u, 1u, 2u}) {
    const background_density few = background_of(scenes::random_stems(random, count, 10, 10));
    CHECK(few.inlier_probability(0.05) == 1);
    CHECK(few.stem_radius() == 0);
    CHECK_FALSE(few.surrounds({5, 5, 0}));
  }
}

TEST_CASE("stems at one place are inliers for certain") {
  const background_density pile = background_of(positions(10, Eigen::Vector3d(1, 2, 3)));
  CHECK(pile.inlier_probability(0.05) == 1);
}

TEST_CASE("the background density is that of the sixth neighbour of each stem") {
  random_source random(112);
  const position_set stems = uneven_stems(150, random);
  const background_density density(stems, std::make_shared<position_index>(stems));
  std::vector<double> densities;
  for (std::size_t i = 0; i < stems.size(); ++i) {
    std::vector<double> squares;
    for (std::size_t j = 0; j < stems.size(); ++j)
      if (j != i) squares.push_back((stems.at[i] - stems.at[j]).xy().squared_norm());
    std::sort(squares.begin(), squares.end());
    densities.push_back(5 / (std::numbers::pi * squares[5]));
  }
  for (const double threshold : {0.1, 0.5, 2.0}) {
    double mean = 0;
    for (const double d : densities)
      mean += (1 - std::exp(-d * std::numbers::pi * threshold * threshold)) / double(densities.size());
    CHECK(density.poisson_inlier_probability(threshold) == Approx(mean));
  }
  std::sort(densities.begin(), densities.end());
  const double middle = (densities[74] + densities[75]) / 2;
  CHECK(density.stem_radius() == Approx(1 / std::sqrt(std::numbers::pi * middle)));
  CHECK(density.extent() == Approx(std::max(middle_extent(stems, 0), middle_extent(stems, 1)) / 0.8));
}

}  // namespace globalmatch::test_background_density

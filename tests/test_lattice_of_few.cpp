#include "globalmatch/detail/matching/lattice_of_few.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include "catch.hpp"
#include "globalmatch/stem_matching.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_lattice_of_few {

using namespace detail;

using scenes::positions;

namespace {

position_set random_stems(random_source& random, std::size_t count) {
  position_set stems;
  for (std::size_t i = 0; i < count; ++i)
    stems.at.push_back({12 * random.uniform(), 12 * random.uniform(), 0});
  return stems;
}

/// Trees 3 m apart, 10 cm off their places.
positions planted(random_source& random, int columns, int rows) {
  return scenes::noisy(scenes::lattice(columns, rows, 3), 0.1, random);
}

}  // namespace

TEST_CASE("a dozen planted stems show their lattice, and how far off its places they are") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const lattice_of_few found = find_lattice_of_few(scenes::set_in_order(planted(random, 4, 3)));
    CHECK(found.occupied > 0.5);
    CHECK(found.sigma > 0.04);
    CHECK(found.sigma < 0.2);
    CHECK(found.inlier_probability(0.3) > 0.3);
    CHECK(found.inlier_probability(0.03) < 0.1);
  }
}

TEST_CASE("few maps of random stems seem planted") {
  constexpr std::size_t maps = 400;
  for (const std::size_t stems : {6u, 10u, 16u}) {
    std::size_t planted = 0;
    for (std::uint64_t seed = 1; seed <= maps; ++seed) {
      random_source random(seed);
      planted += find_lattice_of_few(random_stems(random, stems)).occupied > 0;
    }
    CAPTURE(stems, planted);
    CHECK(planted < maps / 4);
  }
}

TEST_CASE("stems that are too few, too many, in a line or at one place have no lattice of few") {
  random_source random(3);
  CHECK(find_lattice_of_few({}).occupied == 0);
  CHECK(find_lattice_of_few(random_stems(random, 3)).occupied == 0);
  CHECK(find_lattice_of_few(scenes::set_in_order(planted(random, 7, 7))).occupied == 0);  // 49
  position_set line, place;
  for (int i = 0; i < 6; ++i) {
    line.at.push_back({2.0 * i, 0, 0});
    place.at.push_back({1, 1, 0});
  }
  CHECK(find_lattice_of_few(line).occupied == 0);
  CHECK(find_lattice_of_few(place).occupied == 0);
  CHECK(lattice_of_few{}.inlier_probability(1) == 0);
}

TEST_CASE("plantations of few stems that have nothing in common are not registered") {
  constexpr std::uint64_t pairs = 200;
  for (const int side : {3, 4, 5}) {
    std::size_t registered = 0;
    for (std::uint64_t seed = 1; seed <= pairs; ++seed) {
      random_source random(seed);
      const auto some = [&] {
        positions trees = planted(random, side, side);
        std::erase_if(trees, [&](const Eigen::Vector3d&) { return random.uniform() < 0.25; });
        return trees;
      };
      const positions source = some(), target = some();
      registered += match_stems(source, target).outcome == outcome::registered;
    }
    CAPTURE(side, registered);
    CHECK(registered <= 1);
  }
}

TEST_CASE("whether few stems are registered depends neither on their frames nor on which map is the source") {
  std::size_t registered = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    positions source;
    for (int i = 0; i < 6; ++i)
      source.push_back({14 * random.uniform(), 14 * random.uniform(), random.uniform()});
    const positions target = scenes::noisy(source, 0.05, random);
    const outcome given = match_stems(source, target).outcome;
    registered += given == outcome::registered;
    CHECK(match_stems(target, source).outcome == given);
    const positions turned = scenes::moved(scenes::yaw_and_shift(2.1, {400, -90, 3}), source);
    CHECK(match_stems(turned, target).outcome == given);
    CHECK(match_stems(target, turned).outcome == given);
  }
  CHECK(registered > 40);
}

}  // namespace globalmatch::test_lattice_of_few

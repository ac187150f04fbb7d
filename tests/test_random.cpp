#include "globalmatch/detail/core/random.hpp"

#include "catch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace globalmatch::detail::test_random {

TEST_CASE("random_source is splitmix64: the published first values of seed 1234567") {
  random_source random(1234567);
  const std::array<std::uint64_t, 5> published = {6457827717110365317u, 3203168211198807973u,
                                                  9817491932198370423u, 4593380528125082431u,
                                                  16408922859458223821u};
  for (const std::uint64_t value : published) CHECK(random.next() == value);
}

TEST_CASE("random_source repeats itself for equal seed and stream, and only then") {
  std::set<std::uint64_t> first_values;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    for (std::uint64_t stream = 0; stream < 50; ++stream) {
      const std::uint64_t value = random_source(seed, stream).next();
      CHECK(value == random_source(seed, stream).next());
      first_values.insert(value);
    }
  }
  CHECK(first_values.size() == 50 * 50);
}

TEST_CASE("random_source streams are uncorrelated") {
  constexpr int max_iterations = 100000;
  random_source a(7, 1), b(7, 2);
  double product_sum = 0;
  for (int i = 0; i < max_iterations; ++i) product_sum += (a.uniform() - 0.5) * (b.uniform() - 0.5) * 12;
  CHECK(std::abs(product_sum / max_iterations) < 4 / std::sqrt(double(max_iterations)));
}

TEST_CASE("random_source::uniform fills the unit interval evenly") {
  constexpr int max_iterations = 100000;
  std::array<int, 10> counts = {};
  random_source random(1);
  for (int i = 0; i < max_iterations; ++i) {
    const double u = random.uniform();
    REQUIRE(u >= 0);
    REQUIRE(u < 1);
    ++counts[static_cast<std::size_t>(u * 10)];
  }
  for (const int count : counts)
    CHECK(std::abs(count - max_iterations / 10) < 4 * std::sqrt(max_iterations * 0.1 * 0.9));
}

TEST_CASE("random_source::below gives every value below n equally often") {
  constexpr int max_iterations = 70000;
  std::array<int, 7> counts = {};
  random_source random(2);
  for (int i = 0; i < max_iterations; ++i) {
    const std::uint32_t value = random.below(7);
    REQUIRE(value < 7);
    ++counts[value];
  }
  for (const int count : counts)
    CHECK(std::abs(count - max_iterations / 7) < 4 * std::sqrt(max_iterations * (6.0 / 49)));
  CHECK(random.below(1) == 0);
}

TEST_CASE("random_source::below is unbiased where n does not divide 2^32 by far") {
  constexpr int max_iterations = 90000;
  constexpr std::uint32_t n = 3u << 30;  // plain scaling would give every third value twice as often
  random_source random(3);
  int thirds = 0;
  for (int i = 0; i < max_iterations; ++i) thirds += random.below(n) % 3 == 0;
  CHECK(std::abs(thirds - max_iterations / 3) < 4 * std::sqrt(max_iterations * (2.0 / 9)));
}

TEST_CASE("random_source::below refuses n = 0") {
  random_source random(4);
  CHECK_THROWS_AS(random.below(0), std::invalid_argument);
}

TEST_CASE("random_source::normal has the moments of a Gaussian and is always finite") {
  constexpr int max_iterations = 200000;
  random_source random(5);
  std::array<double, 5> moments = {};
  bool all_finite = true;
  for (int i = 0; i < max_iterations; ++i) {
    const double value = random.normal();
    all_finite = all_finite && std::isfinite(value);
    for (std::size_t k = 1; k <= 4; ++k) moments[k] += std::pow(value, double(k)) / max_iterations;
  }
  CHECK(all_finite);
  CHECK(std::abs(moments[1]) < 0.01);
  CHECK(std::abs(moments[2] - 1) < 0.02);
  CHECK(std::abs(moments[3]) < 0.05);
  CHECK(std::abs(moments[4] - 3) < 0.15);
}

}  // namespace globalmatch::detail::test_random

#include "globalmatch/detail/core/float_lanes.hpp"

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_float_lanes {

using namespace detail;

TEST_CASE("a sign is 1 for positive numbers from 1e-30 on, however large, and 0 for others") {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  for (const float x : {1e-30f, 1e-20f, 0.5f, 1.0f, 3e38f, infinity}) {
    CHECK(one_if_positive(x) == 1);
    CHECK(one_if_positive(-x) == 0);
  }
  CHECK(one_if_positive(0.0f) == 0);
  CHECK(one_if_positive(-0.0f) == 0);
  CHECK(one_if_positive(std::numeric_limits<float>::quiet_NaN()) == 0);
}

TEST_CASE("square roots are those of the standard library to 22 bits, of any count, and of nothing else") {
  random_source random(1);
  for (std::size_t count = 0; count <= 21; ++count) {
    std::vector<float> x(count + 2, -7), given;
    for (std::size_t k = 0; k < count; ++k) {
      const double magnitude = std::exp(80 * random.uniform() - 40);
      x[k] = k % 7 == 3 ? 0 : float(magnitude);
    }
    given = x;
    take_square_roots(x.data(), count);
    for (std::size_t k = 0; k < count; ++k)
      CHECK(std::abs(double(x[k]) - std::sqrt(double(given[k]))) <= 5e-7 * std::sqrt(double(given[k])));
    CHECK(x[count] == -7);
    CHECK(x[count + 1] == -7);
  }
}

TEST_CASE("a sum in lanes holds each number once, of any count") {
  for (std::size_t count = 0; count <= 70; ++count) {
    std::vector<float> x;
    double expected = 0;
    for (std::size_t k = 0; k < count; ++k) {
      x.push_back(float(k * k + 3 * k + 1));  // whole numbers: no order of theirs is rounded
      expected += double(k * k + 3 * k + 1);
    }
    x.push_back(1e6f);
    CHECK(double(sum_in_lanes(x.data(), count)) == expected);
  }
}

TEST_CASE("the sum of lanes is taken in doubles") {
  float_lanes x{};
  for (std::size_t k = 0; k < lane_count; ++k)
    x[k] = k == 0 ? 16777216.0f : 1.0f;  // 2^24: floats lose the ones
  CHECK(sum_of(x) == 16777216.0 + 7);
  for (std::size_t k = 0; k < lane_count; ++k) {
    float_lanes one{};
    one[k] = 5;
    CHECK(sum_of(one) == 5);
  }
}

}  // namespace globalmatch::test_float_lanes

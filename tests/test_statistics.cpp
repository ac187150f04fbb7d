#include "globalmatch/detail/core/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "oracles/uniform_sum_tail.hpp"

namespace globalmatch::test_statistics {

using namespace detail;

namespace {

/// The tail itself, by summing.
double binomial_tail(int successes, int tries, double p) {
  double tail = 0;
  for (int k = successes; k <= tries; ++k)
    tail += std::exp(std::lgamma(tries + 1) - std::lgamma(k + 1) - std::lgamma(tries - k + 1) +
                     k * std::log(p) + (tries - k) * std::log1p(-p));
  return tail;
}

}  // namespace

TEST_CASE("the median is the middle value, or the mean of the two in the middle") {
  const auto of = [](std::vector<double> values) { return median(values); };
  CHECK(of({3}) == 3);
  CHECK(of({5, 1}) == 3);
  CHECK(of({9, 1, 2}) == 2);
  CHECK(of({4, 1, 9, 2}) == 3);
  CHECK(of({1, 1, 1, 7}) == 1);
  CHECK(std::isnan(of({})));
}

TEST_CASE("the bound of the binomial tail is above it, and within a small factor of it in the exponent") {
  for (const int tries : {1, 5, 20, 100})
    for (const double p : {1e-4, 0.01, 0.2, 0.7})
      for (int k = 0; k <= tries; ++k) {
        CAPTURE(tries, p, k);
        const double exact = std::log(binomial_tail(k, tries, p)), bound = log_binomial_tail(k, tries, p);
        CHECK(bound <= 0);
        if (exact < -600) continue;  // the sum loses its digits
        CHECK(bound >= exact - 1e-9);
        if (exact < -20) CHECK(bound < 0.9 * exact);
      }
}

TEST_CASE("the tail of no tries is certain, of certain misses impossible") {
  CHECK(log_binomial_tail(0, 0, 0.5) == 0);
  CHECK(log_binomial_tail(3, 10, 1) == 0);
  CHECK(log_binomial_tail(3, 10, 0) == -std::numeric_limits<double>::infinity());
}

TEST_CASE("the tail of a sum of numbers that are uniform or 0 is that of the Irwin-Hall distribution") {
  // probability that the sum of `count` uniform numbers is at most `sum`, by inclusion and exclusion
  const auto irwin_hall = [](int count, double sum) {
    if (sum >= count) return 1.0;
    double share = 0;
    for (int j = 0; j < sum; ++j)
      share += (j % 2 == 0 ? 1 : -1) *
               std::exp(count * std::log(sum - j) - std::lgamma(j + 1) - std::lgamma(count - j + 1));
    return share;
  };
  for (const int tries : {3, 5, 8, 10})
    for (const double p : {0.01, 0.1, 0.4})
      for (const double share : {0.3, 0.6, 0.9}) {
        CAPTURE(tries, p, share);
        double tail = 0;
        for (int k = 1; k <= tries; ++k)
          tail += std::exp(std::lgamma(tries + 1) - std::lgamma(k + 1) - std::lgamma(tries - k + 1) +
                           k * std::log(p) + (tries - k) * std::log1p(-p)) *
                  irwin_hall(k, k - share * tries);
        CHECK(log_uniform_sum_tail(share * tries, tries, p) == Approx(std::log(tail)).margin(0.8));
      }
  CHECK(log_uniform_sum_tail(1, 10, 0.4) == 0);
  CHECK(log_uniform_sum_tail(1, 0, 0.4) == 0);
  CHECK(log_uniform_sum_tail(10, 10, 0.4) == -std::numeric_limits<double>::infinity());
}

TEST_CASE("the tail of one number is itself, that of two x (1 - ln x)") {
  for (const double x : {1.0, 0.99, 0.5, 0.1, 1e-3, 1e-12, 1e-300}) {
    CAPTURE(x);
    CHECK(log_product_tail(std::log(x), 1) == Approx(std::log(x)));
    CHECK(log_product_tail(std::log(x), 2) == Approx(std::log(x * (1 - std::log(x)))).margin(1e-12));
  }
}

TEST_CASE("so many products of uniform numbers are as small as their tail says") {
  constexpr int max_iterations = 100000;
  for (const int count : {2, 3, 4}) {
    random_source random(static_cast<std::uint64_t>(count));
    std::vector<double> tails;
    for (int i = 0; i < max_iterations; ++i) {
      double log_product = 0;
      for (int k = 0; k < count; ++k) log_product += std::log(1 - random.uniform());
      tails.push_back(std::exp(log_product_tail(log_product, count)));
    }
    for (const double p : {0.01, 0.1, 0.5, 0.9}) {
      CAPTURE(count, p);
      const auto smaller = std::count_if(tails.begin(), tails.end(), [&](double t) { return t <= p; });
      CHECK(double(smaller) / max_iterations ==
            Approx(p).margin(4 * std::sqrt(p * (1 - p) / max_iterations)));
    }
  }
}

TEST_CASE("the tail of a product is no probability above 1, and 0 of a product of 0") {
  for (const int count : {1, 2, 3, 10}) {
    double before = 0;
    for (const double log_product : {0.0, -1e-12, -0.1, -1.0, -10.0, -1000.0}) {
      CAPTURE(count, log_product);
      const double tail = log_product_tail(log_product, count);
      CHECK(tail <= before);
      CHECK(tail >= log_product);
      before = tail;
    }
    CHECK(log_product_tail(0, count) == 0);
    CHECK(log_product_tail(-std::numeric_limits<double>::infinity(), count) ==
          -std::numeric_limits<double>::infinity());
  }
}

TEST_CASE("the bound of the binomial tail leaves out the second order of its series alone") {
  for (const int tries : {2, 10, 50})
    for (const int k : {1, 2}) {
      CAPTURE(tries, k);
      const double p = 1e-4 / tries, exact = std::log(binomial_tail(k, tries, p));
      CHECK(log_binomial_tail(k, tries, p) - exact == Approx(0).margin(1e-8));
    }
}

TEST_CASE("the tail of a sum of uniform numbers is good to some hundredths in its logarithm") {
  for (const double p : {0.05, 0.2, 0.6})
    for (const double share : {0.1, 0.35, 0.5}) {
      if (share < 0.75 * p) continue;  // hardly a tail
      CAPTURE(p, share);
      CHECK(log_uniform_sum_tail(share * 30, 30, p) ==
            Approx(oracles::log_uniform_sum_tail(share * 30, 30, p)).margin(0.08));
    }
}

TEST_CASE("the weighted median is that of as many equal values, and the mean of two between two halves") {
  random_source random(9);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<std::pair<double, double>> weighted;
    std::vector<double> repeated;
    const std::size_t count = 1 + random.below(8);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t weight = 1 + random.below(4);
      weighted.emplace_back(random.normal(), double(weight));
      repeated.insert(repeated.end(), weight, weighted.back().first);
    }
    CHECK(weighted_median(weighted) == median(repeated));
  }
  CHECK(std::isnan(weighted_median({})));
}

TEST_CASE("the tail of a beta-binomial distribution is that of a binomial one without correlation") {
  const double choose[] = {1, 8, 28, 56, 70, 56, 28, 8, 1};
  for (const double p : {0.1, 0.5, 0.9}) {
    double tail = 0;
    for (std::size_t k = 0; k < 8; ++k) {
      tail += choose[k] * std::pow(p, double(k)) * std::pow(1 - p, double(8 - k));
      CHECK(log_beta_binomial_tail(k, 8, p, 1e-9) == Approx(std::log(tail)).epsilon(1e-5).margin(1e-6));
    }
    CHECK(log_beta_binomial_tail(8, 8, p, 0.2) == Approx(0).margin(1e-12));
  }
  // Uniform from 0 to 1, the share makes all numbers of successes equally probable.
  for (std::size_t k = 0; k < 8; ++k)
    CHECK(log_beta_binomial_tail(k, 8, 0.5, 1.0 / 3) == Approx(std::log(double(k + 1) / 9)));
  CHECK(log_beta_binomial_tail(2, 40, 0.7, 0.3) > log_beta_binomial_tail(2, 40, 0.7, 0.1));
}

}  // namespace globalmatch::test_statistics

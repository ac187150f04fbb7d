#include "globalmatch/detail/matching/t_estimates.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_t_estimates {

using namespace detail;

namespace {

using scenes::uniform;

/// Heights over a plane, a tenth of them metres off.
observation_kind heights_over_plane(double at_zero, double slope_x, double slope_y, double noise,
                                    std::size_t count, random_source& random) {
  observation_kind kind{.dimensions = 1};
  for (std::size_t i = 0; i < count; ++i) {
    const double x = uniform(random, -20, 30), y = uniform(random, -5, 12);
    const double wrong = i % 10 == 3 ? uniform(random, 1, 4) : 0;
    const double z = at_zero + slope_x * x + slope_y * y + noise * random.normal() + wrong;
    kind.of.push_back({{{{{1, x, y, 0, 0, 0}, z}}}});
  }
  return kind;
}

double log_likelihood(const observation_kind& kind, const small_vector& parameters, double scale) {
  double sum = 0;
  for (const observation& o : kind.of) {
    const auto n = double(kind.dimensions);
    double squares = 0;
    for (std::size_t d = 0; d < kind.dimensions; ++d) {
      double rest = o.coordinates[d].right;
      for (std::size_t k = 0; k < 6; ++k) rest -= o.coordinates[d].row[k] * parameters[k];
      squares += std::pow(rest / (o.relative * scale), 2);
    }
    sum -= n * std::log(scale) + (3 + n) / 2 * std::log(1 + squares / 3);
  }
  return sum;
}

}  // namespace

TEST_CASE("outliers of metres on one side do not move a plane by centimetres") {
  random_source random(3);
  observation_kind kinds[] = {heights_over_plane(2.5, 0.03, -0.07, 0.02, 200, random)};
  const t_estimate e = estimate_by_t(kinds, 6, 1e-4);
  CHECK(e.parameters[0] == Approx(2.5).margin(0.01));
  CHECK(e.parameters[1] == Approx(0.03).margin(0.0005));
  CHECK(e.parameters[2] == Approx(-0.07).margin(0.001));
  for (int k = 3; k < 6; ++k) CHECK(e.parameters[std::size_t(k)] == 0);
}

TEST_CASE("no parameters and no scale around the estimate are more likely") {
  random_source random(8);
  observation_kind kinds[] = {heights_over_plane(-1, 0.2, 0.1, 0.3, 60, random)};
  for (observation& o : kinds[0].of) o.relative = uniform(random, 0.5, 2);
  const t_estimate e = estimate_by_t(kinds, 6, 1e-4);
  const double best = log_likelihood(kinds[0], e.parameters, e.scale);
  CHECK(best == Approx(e.log_likelihood));
  for (const double step : {-1.0, 1.0}) {
    CHECK(log_likelihood(kinds[0], e.parameters, e.scale * std::exp(0.02 * step)) < best);
    const double by[] = {0.02, 0.002, 0.004};
    for (std::size_t k = 0; k < 3; ++k) {
      small_vector moved = e.parameters;
      moved[k] += step * by[k];
      CHECK(log_likelihood(kinds[0], moved, e.scale) < best);
    }
  }
}

TEST_CASE("of observations of two coordinates no scale around the estimate is more likely") {
  random_source random(9);
  observation_kind kinds[] = {{.dimensions = 2}};
  for (int i = 0; i < 80; ++i)
    kinds[0].of.push_back({{{{{1, 0, 0, 0, 0, 0}, 3 + 0.2 * random.normal()},
                             {{0, 1, 0, 0, 0, 0}, -2 + 0.2 * random.normal()}}},
                           uniform(random, 0.5, 2)});
  const t_estimate e = estimate_by_t(kinds, 6, 1e-4);
  const double best = log_likelihood(kinds[0], e.parameters, e.scale);
  CHECK(best == Approx(e.log_likelihood));
  for (const double by : {0.98, 1.02}) CHECK(log_likelihood(kinds[0], e.parameters, e.scale * by) < best);
}

TEST_CASE("kinds of observations share parameters, each with a scale of its own") {
  random_source random(5);
  observation_kind kinds[2] = {{.dimensions = 2}, {.dimensions = 1}};
  for (int i = 0; i < 400; ++i) {
    kinds[0].of.push_back({{{{{1, 0, 0, 0, 0, 0}, 3 + 0.01 * random.normal()},
                             {{0, 1, 0, 0, 0, 0}, -2 + 0.01 * random.normal()}}}});
    kinds[1].of.push_back({{{{{1, 1, 0, 0, 0, 0}, 1 + 0.5 * random.normal()}}}});
  }
  const t_estimate e = estimate_by_t(kinds, 6, 1e-4);
  CHECK(e.parameters[0] == Approx(3).margin(0.002));
  CHECK(e.parameters[1] == Approx(-2).margin(0.002));
  CHECK(kinds[0].scale == e.scale);
  CHECK(kinds[1].scale / kinds[0].scale == Approx(50).epsilon(0.15));
}

TEST_CASE("the covariance is that of the estimates, whether noise is normal, uniform or has outliers") {
  constexpr int trials = 1500, count = 80;
  const auto ratio_of = [](const auto& noise, std::size_t dimensions) {
    double squares = 0;
    for (int trial = 0; trial < trials; ++trial) {
      random_source random(std::uint64_t(trial) + 1);
      observation_kind kinds[] = {{.dimensions = dimensions}};
      for (int i = 0; i < count; ++i) {
        const double relative = i % 2 ? 1 : 2;
        kinds[0].of.push_back({{{{{1, 0, 0, 0, 0, 0}, 5 + relative * noise(random)},
                                 {{0, 1, 0, 0, 0, 0}, 8 + relative * noise(random)}}},
                               relative});
      }
      const t_estimate e = estimate_by_t(kinds, 6, 1e-4);
      squares += std::pow(e.parameters[0] - 5, 2) / e.covariance(0, 0) / trials;
    }
    return std::sqrt(squares);
  };
  const auto normal = [](random_source& r) { return 0.3 * r.normal(); };
  const auto constant = [](random_source& r) { return uniform(r, -1, 1); };
  const auto spoiled = [](random_source& r) { return (r.uniform() < 0.15 ? 3 : 0.3) * r.normal(); };
  for (const std::size_t dimensions : {1u, 2u}) {
    CHECK(ratio_of(normal, dimensions) == Approx(1).epsilon(0.07));
    CHECK(ratio_of(constant, dimensions) == Approx(1).epsilon(0.1));
    CHECK(ratio_of(spoiled, dimensions) == Approx(1).epsilon(0.07));
  }
}

TEST_CASE("equal observations have the smallest scale, none at all no parameters") {
  observation_kind equal[] = {{.dimensions = 1}};
  for (int i = 0; i < 5; ++i) equal[0].of.push_back({{{{{1, 0, 0, 0, 0, 0}, 7}}}});
  const t_estimate e = estimate_by_t(equal, 6, 1e-3);
  CHECK(e.parameters[0] == Approx(7));
  CHECK(e.scale == 1e-3);
  observation_kind none[] = {{.dimensions = 2}};
  const t_estimate empty = estimate_by_t(none, 6, 1e-3);
  CHECK(empty.log_likelihood == 0);
  CHECK(std::all_of(empty.parameters.begin(), empty.parameters.end(), [](double p) { return p == 0; }));
}

}  // namespace globalmatch::test_t_estimates

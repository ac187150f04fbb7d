#include "globalmatch/detail/matching/residual_null_model.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_residual_null_model {

using namespace detail;

namespace {

using transforms = std::vector<std::vector<float>>;

/// Residuals of so many pairs; `together`: by how much all of them are larger or smaller than usual.
std::vector<float> drawn(std::size_t pairs, double together, random_source& random) {
  const double scale = 0.1 * std::exp(together * random.normal());
  std::vector<float> residuals;
  for (std::size_t i = 0; i < pairs; ++i) residuals.push_back(float(scale * std::abs(random.normal())));
  return residuals;
}

transforms drawn_transforms(std::size_t count, std::size_t pairs, double together, random_source& random) {
  transforms all;
  for (std::size_t i = 0; i < count; ++i) all.push_back(drawn(pairs, together, random));
  return all;
}

std::vector<float> times(double factor, std::vector<float> residuals) {
  for (float& residual : residuals) residual = float(factor * residual);
  return residuals;
}

}  // namespace

TEST_CASE(
    "under the null model a fit is as improbable as is said, or less, also where all pairs go together") {
  for (const double together : {0.0, 0.3, 1.0, 2.0})
    for (const std::size_t pairs : {6u, 12u, 30u, 100u}) {
      CAPTURE(together, pairs);
      int all = 0, in_ten = 0, in_hundred = 0;
      for (std::uint64_t seed = 1; seed <= 40; ++seed) {
        random_source random(seed);
        const residual_null_model null_model(drawn_transforms(200, pairs, together, random));
        for (int i = 0; i < 250; ++i, ++all) {
          const double log_probability = null_model.log_probability(drawn(pairs, together, random));
          in_ten += log_probability <= std::log(0.1);
          in_hundred += log_probability <= std::log(0.01);
        }
      }
      CHECK(in_ten > 0.03 * all);
      CHECK(in_ten < 0.12 * all);
      CHECK(in_hundred > 0);
      CHECK(in_hundred < 0.02 * all);
    }
}

TEST_CASE("the number of pairs need not be that of the transforms that were learned from") {
  int all = 0, in_hundred = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    random_source random(seed);
    transforms of_many_sizes;
    for (std::size_t pairs = 12; pairs < 212; ++pairs) of_many_sizes.push_back(drawn(pairs, 0.5, random));
    const residual_null_model null_model(of_many_sizes);
    for (std::size_t pairs = 12; pairs < 212; ++pairs, ++all)
      in_hundred += null_model.log_probability(drawn(pairs, 0.5, random)) <= std::log(0.01);
  }
  CHECK(in_hundred < 0.02 * all);
}

TEST_CASE("pairs that fit several times better than others are significant, the more of them the surer") {
  random_source random(1);
  const residual_null_model null_model(drawn_transforms(100, 50, 0, random));
  double before = 0;
  for (const std::size_t pairs : {12u, 25u, 50u, 100u}) {
    const double log_probability = null_model.log_probability(times(0.2, drawn(pairs, 0, random)));
    CHECK(log_probability < before - 3);
    before = log_probability;
  }
}

TEST_CASE("pairs that fit as well as others or worse are not significant") {
  random_source random(1);
  const residual_null_model null_model(drawn_transforms(100, 50, 0, random));
  CHECK(null_model.log_probability(times(2, drawn(50, 0, random))) == 0);
  CHECK(null_model.log_probability(times(1000, drawn(50, 0, random))) == 0);
}

TEST_CASE("where pairs go together a good fit of all of them is less improbable") {
  random_source random(1);
  const auto good = times(0.2, drawn(50, 0, random));
  const residual_null_model apart(drawn_transforms(100, 50, 0, random)),
      together(drawn_transforms(100, 50, 1, random));
  CHECK(together.log_probability(good) > 0.5 * apart.log_probability(good));
  CHECK(together.log_probability(good) < -1);
}

TEST_CASE("some pairs that are far off take little from a good fit of the others") {
  random_source random(1);
  const residual_null_model null_model(drawn_transforms(100, 20, 0, random));
  auto good = times(0.2, drawn(16, 0, random));
  const double without = null_model.log_probability(good);
  good.insert(good.end(), 2, 100.f);
  CHECK(null_model.log_probability(good) > without);
  CHECK(null_model.log_probability(good) < 0.7 * without);
  for (std::size_t i = 0; i < good.size() - 2; ++i) good[i] *= 5;
  CHECK(null_model.log_probability(good) > -3);
}

TEST_CASE("residuals in other units are worth the same, bit for bit") {
  random_source random(1);
  const transforms known = drawn_transforms(100, 30, 0.3, random);
  transforms scaled;
  for (const auto& residuals : known) scaled.push_back(times(1024, residuals));
  const residual_null_model null_model(known), model_of_scaled(scaled);
  for (int i = 0; i < 20; ++i) {
    const auto residuals = times(0.5, drawn(30, 0, random));
    const double log_probability = null_model.log_probability(residuals);
    CHECK(log_probability < 0);
    CHECK(model_of_scaled.log_probability(times(1024, residuals)) == log_probability);
  }
}

TEST_CASE("the order of the pairs and of the transforms does not count") {
  random_source random(1);
  transforms known = drawn_transforms(50, 20, 0.3, random);
  auto residuals = times(0.5, drawn(20, 0, random));
  const double log_probability = residual_null_model(known).log_probability(residuals);
  std::reverse(known.begin(), known.end());
  std::reverse(residuals.begin(), residuals.end());
  CHECK(log_probability < -1);
  CHECK(residual_null_model(known).log_probability(residuals) == Approx(log_probability));
}

TEST_CASE("fewer than six pairs are not significant, and nothing is learned from them") {
  random_source random(1);
  const residual_null_model null_model(drawn_transforms(100, 6, 0, random));
  REQUIRE(null_model.is_known());
  CHECK(null_model.log_probability(std::vector<float>(5, 0)) == 0);
  CHECK(null_model.log_probability(std::vector<float>(6, 0)) < -10);
  CHECK(null_model.log_probability({}) == 0);
  const residual_null_model of_few(drawn_transforms(100, 5, 0, random));
  CHECK_FALSE(of_few.is_known());
  CHECK(of_few.log_probability(std::vector<float>(12, 0)) == 0);
}

TEST_CASE("where there is nothing to learn from the null model is not known") {
  CHECK_FALSE(residual_null_model().is_known());
  CHECK_FALSE(residual_null_model(transforms{}).is_known());
  CHECK_FALSE(residual_null_model(transforms(20)).is_known());
  CHECK(residual_null_model().log_probability(std::vector<float>(12, 0)) == 0);
  CHECK(residual_null_model(transforms(20)).log_probability(std::vector<float>(12, 0)) == 0);
}

TEST_CASE("residuals that are all equal are not significant, though smaller ones are") {
  for (const float size : {0.f, 0.25f}) {
    const residual_null_model null_model(transforms(30, std::vector<float>(40, size)));
    REQUIRE(null_model.is_known());
    CHECK(null_model.log_probability(std::vector<float>(40, size)) == Approx(0).margin(1));
    CHECK(null_model.log_probability(std::vector<float>(40, size + 1)) == 0);
    CHECK(null_model.log_probability(std::vector<float>(40, size - 1)) < -20);
  }
}

TEST_CASE("residuals in few steps, as of radii to the centimetre, are no better than they are") {
  int all = 0, in_hundred = 0;
  const auto in_steps = [](std::vector<float> residuals) {
    for (float& residual : residuals) residual = std::round(10 * residual) / 10;
    return residuals;
  };
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    random_source random(seed);
    transforms known = drawn_transforms(200, 30, 0, random);
    for (auto& residuals : known) residuals = in_steps(residuals);
    const residual_null_model null_model(known);
    for (int i = 0; i < 250; ++i, ++all)
      in_hundred += null_model.log_probability(in_steps(drawn(30, 0, random))) <= std::log(0.01);
  }
  CHECK(in_hundred < 0.015 * all);
}

TEST_CASE("some of many residuals are enough to learn from") {
  random_source random(1);
  const residual_null_model null_model(drawn_transforms(400, 500, 0, random));
  const double log_probability = null_model.log_probability(drawn(500, 0, random));
  CHECK(log_probability > -5);
  CHECK(null_model.log_probability(times(0.5, drawn(500, 0, random))) < -50);
}

TEST_CASE("residuals count by how much smaller they are than half of the known ones") {
  std::vector<std::vector<float>> known(40);
  for (int i = 0; i < 2000; ++i) known[std::size_t(i % 40)].push_back(float((i * 769 % 2000) + 1));
  const residual_null_model model(known);
  std::vector<float> asked;
  double nearness = 0;
  for (int i = 0; i < 20; ++i) {
    asked.push_back(float(60 * i + 10));
    nearness += std::max(0.0, 1 - 2 * (60.0 * i + 10) / 2001);
  }
  CHECK(model.log_probability(asked) == Approx(log_uniform_sum_tail(nearness, 20, 0.5)).epsilon(0.01));
}

TEST_CASE("residuals that go together in the known transforms make a good fit less improbable") {
  random_source random(113);
  std::vector<std::vector<float>> known;
  std::vector<double> factors;
  for (int i = 0; i < 200; ++i) {
    const double scale = std::exp(0.5 * random.normal());
    known.emplace_back();
    for (int k = 0; k < 40; ++k) known.back().push_back(float(-scale * std::log(1 - random.uniform())));
  }
  const residual_null_model model(known);
  int improbable = 0;
  for (int i = 0; i < 2000; ++i) {
    const double scale = std::exp(0.5 * random.normal());
    std::vector<float> residuals;
    for (int k = 0; k < 40; ++k) residuals.push_back(float(-scale * std::log(1 - random.uniform())));
    improbable += model.log_probability(residuals) < std::log(0.05);
  }
  CHECK(improbable > 0.005 * 2000);
  CHECK(improbable < 0.09 * 2000);
}

TEST_CASE("sums of many pairs are taken for no narrower than those of few, and wider beyond what is known") {
  random_source random(3);
  transforms known = drawn_transforms(200, 40, 1, random);
  const residual_null_model of_few(known);
  transforms many;
  for (const auto& residuals : drawn_transforms(60, 130, 0, random)) many.push_back(times(0.7, residuals));
  known.insert(known.end(), many.begin(), many.end());
  const residual_null_model of_both(known);
  const auto good = times(0.3, drawn(130, 0, random));
  const std::vector<float> fewer(good.begin(), good.begin() + 60);
  CHECK(of_both.log_probability(good) < 0);
  CHECK(of_both.log_probability(good) > 3 * of_both.log_probability(fewer));
  CHECK(of_few.log_probability(good) > 1.5 * of_few.log_probability(fewer));
}

TEST_CASE("nothing is learned from few transforms, of which no one knows whether pairs go together") {
  random_source random(4);
  for (const std::size_t count : {5u, 10u, 14u}) {
    const residual_null_model null_model(drawn_transforms(count, 30, 1, random));
    CHECK_FALSE(null_model.is_known());
    CHECK(null_model.log_probability(std::vector<float>(30, 0)) == 0);
  }
  // Where there are just enough they are as improbable as is said, or hardly less.
  for (const std::size_t count : {30u, 60u}) {
    CAPTURE(count);
    int all = 0, in_thousand = 0;
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
      random_source own(seed);
      const residual_null_model null_model(drawn_transforms(count, 30, 1, own));
      for (int i = 0; i < 100; ++i, ++all)
        in_thousand += null_model.log_probability(drawn(30, 1, own)) <= std::log(0.001);
    }
    CHECK(in_thousand < 0.004 * all);
  }
}

}  // namespace globalmatch::test_residual_null_model

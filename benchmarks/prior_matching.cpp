// Maps of few stems, matched with a prior and without: how many of those are registered whose true transform
// is significant under the prior, and how many maps that have nothing in common?
#include <globalmatch/detail/core/position_index.hpp>
#include <globalmatch/detail/matching/decision.hpp>
#include <globalmatch/detail/matching/null_model.hpp>
#include <globalmatch/detail/matching/position_evidence.hpp>
#include <globalmatch/detail/matching/prior.hpp>
#include <globalmatch/detail/matching/score_hypothesis.hpp>
#include <globalmatch/stem_matching.hpp>

#include "stem_layouts.hpp"
#include "support/programs/command_line.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iomanip>
#include <iostream>
#include <memory>
#include <numbers>
#include <string>

using namespace globalmatch;
using namespace globalmatch::detail;
using namespace globalmatch::benchmarks;

namespace {

struct parameters {
  std::size_t pairs = 200, seed = 1;
  double noise = 0.03, sigma_position = 5, sigma_yaw_deg = 10;
};

Eigen::Vector3d any_place(double radius, random_source& random) {
  const double direction = uniform(random, 0, 2 * std::numbers::pi), r = radius * std::sqrt(random.uniform());
  return {r * std::cos(direction), r * std::sin(direction), 0};
}

/// Two maps of `stems` each, of which `common` are in both, at a density [1/m^2].
two_maps few_stems(std::size_t stems, std::size_t common, double density, double noise,
                   random_source& random) {
  const double radius = std::sqrt(double(stems) / density / std::numbers::pi);
  two_maps maps;
  maps.common = common;
  maps.target_from_source = any_yaw_elsewhere(random);
  for (std::size_t i = 0; i < stems; ++i) {
    const Eigen::Vector3d place = any_place(radius, random);
    maps.source.push_back(place + gaussian(random, noise));
    const Eigen::Vector3d& seen = i < common ? place : any_place(radius, random);
    maps.target.push_back(maps.target_from_source * seen + gaussian(random, noise));
  }
  return maps;
}

/// A prior that differs from the truth as its standard deviations say.
transform_prior prior_of(const two_maps& maps, const parameters& given, random_source& random) {
  transform_prior prior;
  prior.sigma_position = given.sigma_position;
  prior.sigma_yaw = given.sigma_yaw_deg * std::numbers::pi / 180;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : maps.source) center += p / double(maps.source.size());
  const Eigen::Vector3d place = maps.target_from_source * center;
  const Eigen::Vector3d shift = prior.sigma_position * Eigen::Vector3d(random.normal(), random.normal(), 0);
  prior.target_from_source = Eigen::Translation3d(place + shift) *
                             Eigen::AngleAxisd(prior.sigma_yaw * random.normal(), Eigen::Vector3d::UnitZ()) *
                             Eigen::Translation3d(-place) * maps.target_from_source;
  return prior;
}

/// Whether the true transform, refitted, would be registered.
bool is_significant(const two_maps& maps, const matching_options& options) {
  const execution exec;
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const position_set source = import_positions(maps.source, up, "source", exec),
                     target = import_positions(maps.target, up, "target", exec);
  const matching_context context(source, target, std::make_shared<position_index>(source),
                                 std::make_shared<position_index>(target), true, degrees_of_freedom::four,
                                 exec, local_prior(*options.prior, source, target));
  null_model null(context, pairing_thresholds);
  null.include_reversed();
  local_hypothesis h;
  h.target_from_source = target.frame.local_from_scan() * from_eigen(maps.target_from_source) *
                         source.frame.local_from_scan().inverse();
  score_hypothesis(h, context, null, pairing_thresholds);
  return decide({&h, 1}, context, options.decision).outcome == outcome::registered;
}

/// Stems that are in both maps have one index.
bool is_right(const matching& result, std::size_t common) {
  const auto& pairs = result.hypotheses.front().correspondences;
  const auto right = std::count_if(pairs.begin(), pairs.end(), [&](const correspondence& c) {
    return c.source == c.target && c.source < common;
  });
  return 2 * std::size_t(right) > pairs.size();
}

struct counts {
  std::size_t significant = 0, registered = 0, wrong = 0, without = 0, unrelated = 0;
};

counts run(std::size_t stems, std::size_t common, double density, const parameters& given,
           random_source& random) {
  counts c;
  for (std::size_t i = 0; i < given.pairs; ++i) {
    const two_maps maps = few_stems(stems, common, density, given.noise, random);
    matching_options options;
    options.prior = prior_of(maps, given, random);
    const matching with = match_stems(maps.source, maps.target, options);
    const bool right = with.outcome == outcome::registered && is_right(with, common);
    c.wrong += with.outcome == outcome::registered && !right;
    if (is_significant(maps, options)) ++c.significant, c.registered += right;
    const matching without = match_stems(maps.source, maps.target);
    c.without += without.outcome == outcome::registered && is_right(without, common);
    const two_maps unrelated = few_stems(stems, 0, density, given.noise, random);
    options.prior = prior_of(unrelated, given, random);
    c.unrelated += match_stems(unrelated.source, unrelated.target, options).outcome == outcome::registered;
  }
  return c;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Matches maps of few stems with a prior and without.", "prior_matching");
  parameters given;
  app.add_option("--pairs", given.pairs, "of each size, density and number of common stems")
      ->capture_default_str();
  app.add_option("--seed", given.seed, "seed of the random numbers")->capture_default_str();
  app.add_option("--noise", given.noise, "of each coordinate [m]")->capture_default_str();
  app.add_option("--sigma-position", given.sigma_position, "of the prior [m]")->capture_default_str();
  app.add_option("--sigma-yaw", given.sigma_yaw_deg, "of the prior [degrees]")->capture_default_str();
  return support::run_program(app, argc, argv, [&] {
    random_source random(given.seed);
    std::cout << "| stems | a hectare | common | significant | registered of these, right | wrong | "
                 "without prior, right | unrelated, registered |\n|---|---|---|---|---|---|---|---|\n";
    counts all;
    for (const std::size_t stems : {6u, 10u, 20u, 40u})
      for (const double per_hectare : {200, 800})
        for (const std::size_t common : {4u, 5u, 6u, 8u, 16u, 32u}) {
          if (common > stems) continue;
          const counts c = run(stems, common, per_hectare / 1e4, given, random);
          std::cout << "| " << stems << " | " << per_hectare << " | " << common << " | " << c.significant
                    << " | " << c.registered << " | " << c.wrong << " | " << c.without << " | " << c.unrelated
                    << " |" << std::endl;
          all.significant += c.significant, all.registered += c.registered, all.wrong += c.wrong;
          all.without += c.without, all.unrelated += c.unrelated;
        }
    std::cout << "| all | | | " << all.significant << " | " << all.registered << " | " << all.wrong << " | "
              << all.without << " | " << all.unrelated << " |\n";
    return support::done;
  });
}

// Is the uncertainty calibrated? Transforms of made-up pairs of stems, and how often their 95 % ellipse holds
// the truth.
#include <globalmatch/detail/matching/uncertainty.hpp>

#include <Eigen/Cholesky>

#include "noisy_match.hpp"
#include "support/programs/command_line.hpp"

#include <iomanip>
#include <iostream>

using namespace globalmatch;
using namespace globalmatch::detail;
using scenes::noisy_match;

namespace {

/// Whether the horizontal ellipse holds the true place of a point of the target.
bool holds(const noisy_match& match, const transform_uncertainty& u, const Eigen::Vector3d& place) {
  constexpr double quantile = 5.991;  // chi squared of two, 95 %
  const Eigen::Vector2d off = (match.error() * place - place).head<2>();
  const Eigen::Matrix2d covariance = u.at(place).topLeftCorner<2, 2>();
  return off.dot(covariance.ldlt().solve(off)) < quantile;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("How often [%] the horizontal 95 % ellipse holds the truth, at the centroid and 50 m away.",
               "uncertainty_coverage");
  int trials = 5000;
  double noise = 0.05;
  app.add_option("--trials", trials, "for each number of pairs")->capture_default_str();
  app.add_option("--noise", noise, "of each coordinate of the target [m]")->capture_default_str();
  return support::run_program(app, argc, argv, [&] {
    std::cout << "| dof | pairs | at the centroid | 50 m away |\n|---|---|---|---|\n" << std::setprecision(3);
    for (const degrees_of_freedom dof : {degrees_of_freedom::four, degrees_of_freedom::six})
      for (const std::size_t pairs : {5u, 10u, 30u, 100u}) {
        random_source random(1);
        int near = 0, far = 0;
        for (int i = 0; i < trials; ++i) {
          noisy_match match(pairs, dof, noise, random);
          fit_robustly(match.best, match.maps);
          const auto u = scenes::reported_uncertainty(match);
          near += holds(match, *u, u->center);
          far += holds(match, *u, u->center + Eigen::Vector3d(40, -30, 0));
        }
        std::cout << "| " << int(dof) << " | " << pairs << " | " << 100.0 * near / trials << " | "
                  << 100.0 * far / trials << " |\n";
      }
    return support::done;
  });
}

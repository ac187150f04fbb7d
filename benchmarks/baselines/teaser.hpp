// TEASER++ (Yang, Shi, Carlone 2021, "TEASER: fast and certifiable point cloud registration", IEEE T-RO
// 37(2)) on all associations of stems in plan: the largest clique of associations whose lengths agree, by
// their own program, rotation about the vertical alone (Quatro). Ours: stems without heights; the least
// squares over all agreeing stems in the end.
#pragma once

#include "baselines/consistent_associations.hpp"

#include <teaser/registration.h>

#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

namespace globalmatch::benchmarks {

struct teaser_options {
  std::size_t max_associations = 4000;  ///< as all pairs of them are made
};

inline match_run run_teaser(const two_maps& maps, const run_limits& limits, double inlier_threshold,
                            const teaser_options& options = {}) {
  const auto search = [&](const stem_alignment& alignment, const consistent_associations& associations,
                          const execution& exec) -> std::optional<std::vector<int>> {
    if (associations.size() > options.max_associations) return std::nullopt;
    if (associations.count() == 0) return std::vector<int>();
    Eigen::Matrix3Xd source(3, Eigen::Index(associations.size())), target(source);
    for (std::size_t a = 0; a < associations.size(); ++a) {
      const correspondence c = associations[a];
      const vec2 from = alignment.source.at[c.source].xy(), to = alignment.target.at[c.target].xy();
      source.col(Eigen::Index(a)) << from.x, from.y, 0;
      target.col(Eigen::Index(a)) << to.x, to.y, 0;
    }
    teaser::RobustRegistrationSolver::Params params;
    params.noise_bound = inlier_threshold / 2;  // lengths may differ by twice the bound of a stem
    params.estimate_scaling = false;
    params.rotation_estimation_algorithm =
        teaser::RobustRegistrationSolver::ROTATION_ESTIMATION_ALGORITHM::QUATRO;
    params.max_clique_num_threads = int(thread_count(exec));
    if (std::isfinite(limits.seconds)) params.max_clique_time_limit = limits.seconds;
    teaser::RobustRegistrationSolver solver(params);
    solver.solve(source, target);
    return solver.getInlierMaxClique();
  };
  return match_by_clique(maps, limits, inlier_threshold, search);
}

}  // namespace globalmatch::benchmarks

// CLIPPER (Lusk, Fathian, How 2021, "CLIPPER: a graph-theoretic framework for robust data association", ICRA)
// on all associations of stems in plan: the densest clique of associations whose lengths agree. Theirs, by
// their own program: the search for the clique. Ours: the sparse graph of consistent associations, whose
// weights are those of their Euclidean invariant; the least squares over all agreeing stems in the end.
#pragma once

#include "baselines/consistent_associations.hpp"

#include <clipper/clipper.h>

#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

namespace globalmatch::benchmarks {

struct clipper_options {
  double sigma_share = 0.5;  ///< of the inlier threshold, the spread of differences of lengths
  double bytes_a_pair = 80;  ///< of consistent associations, in triplets and two sparse matrices
};

inline match_run run_clipper(const two_maps& maps, const run_limits& limits, double inlier_threshold,
                             const clipper_options& options = {}) {
  const auto search = [&](const stem_alignment&, const consistent_associations& associations,
                          const execution&) -> std::optional<std::vector<int>> {
    const std::size_t pairs = associations.count();
    if (double(pairs) * options.bytes_a_pair > limits.memory) return std::nullopt;
    if (pairs == 0) return std::vector<int>();
    std::vector<clipper::SpTriplet> weights, allowed;
    weights.reserve(pairs), allowed.reserve(pairs);
    associations.for_each_pair([&](std::size_t a, std::size_t b, double difference) {
      const double deviations = difference / (options.sigma_share * inlier_threshold);
      weights.emplace_back(int(a), int(b), std::exp(-0.5 * deviations * deviations));
      allowed.emplace_back(int(a), int(b), 1.0);
    });
    const auto size = Eigen::Index(associations.size());
    clipper::SpAffinity affinity(size, size);
    clipper::SpConstraint constraint(size, size);
    affinity.setFromTriplets(weights.begin(), weights.end());
    constraint.setFromTriplets(allowed.begin(), allowed.end());
    const auto invariant = std::make_shared<clipper::invariants::EuclideanDistance>(
        clipper::invariants::EuclideanDistance::Params{});  // not asked: the graph is given
    clipper::CLIPPER solver(invariant, clipper::Params{});
    solver.setSparseMatrixData(affinity, constraint);
    solver.solve();
    return solver.getSolution().nodes;
  };
  return match_by_clique(maps, limits, inlier_threshold, search);
}

}  // namespace globalmatch::benchmarks

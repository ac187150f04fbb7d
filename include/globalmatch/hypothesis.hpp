// Hypotheses: a motion with the stems it pairs. Verified over all stems, ranked, and told apart.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstddef>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "globalmatch/neighbors.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/position_set.hpp"
#include "globalmatch/transform.hpp"

namespace globalmatch {

/// One stem in two maps.
struct correspondence {
  stem_index source, target;
  auto operator<=>(const correspondence&) const = default;
};

/// A motion that may be the right one, and what speaks for it.
struct hypothesis {
  std::vector<correspondence> correspondences;  ///< one to one, increasing
  Eigen::Isometry3d target_from_source = Eigen::Isometry3d::Identity();
  double tolerance = 0;       ///< [m] stems this near each other were paired
  double rms = 0;             ///< [m] distance of paired stems
  std::size_t consensus = 0;  ///< triangle pairs in its consensus set
};

/// Better supported first: more paired stems, then nearer ones.
inline bool ranks_before(const hypothesis& a, const hypothesis& b) {
  const auto most = [](const hypothesis& h) { return h.correspondences.size(); };
  return std::tuple(most(b), a.rms, b.consensus) < std::tuple(most(a), b.rms, a.consensus);
}

/// Two maps about to be matched, with what verification needs over and over.
class map_pair {
 public:
  map_pair(const position_set& from, const position_set& onto, bool in_plan, degrees_of_freedom freedom)
      : source(from),
        target(onto),
        horizontal(in_plan),
        dof(freedom),
        target_tree_(onto.size(), [&](std::size_t i) { return compared(onto.at[i]); }) {}

  const position_set &source, &target;
  const bool horizontal;  ///< distances in plan
  const degrees_of_freedom dof;

  /// Pairs every source stem with the target stem it is laid on, nearest first, one to one, within
  /// `tolerance` [m].
  std::vector<correspondence> pair_stems(const Eigen::Isometry3d& target_from_source,
                                         double tolerance) const {
    std::vector<std::pair<double, correspondence>> candidates;
    for (stem_index s = 0; s < source.size(); ++s) {
      const Eigen::Vector3d laid = compared(target_from_source * source.at[s]);
      target_tree_.for_each_within({laid.x(), laid.y(), laid.z()}, tolerance,
                                   [&](std::uint32_t t, double squared) {
                                     candidates.push_back({squared, {s, static_cast<stem_index>(t)}});
                                   });
    }
    std::sort(candidates.begin(), candidates.end());
    std::vector<bool> source_taken(source.size()), target_taken(target.size());
    std::vector<correspondence> pairs;
    for (const auto& [squared, c] : candidates) {
      if (source_taken[c.source] || target_taken[c.target]) continue;
      source_taken[c.source] = target_taken[c.target] = true;
      pairs.push_back(c);
    }
    std::sort(pairs.begin(), pairs.end());
    return pairs;
  }

  /// Least squares motion over the correspondences, and the root mean square distance [m] it leaves.
  std::optional<std::pair<Eigen::Isometry3d, double>> fit(std::span<const correspondence> pairs) const {
    std::vector<Eigen::Vector3d> from, to;
    for (const correspondence& c : pairs) {
      from.push_back(source.at[c.source]);
      to.push_back(target.at[c.target]);
    }
    const auto motion = fit_transform(from, to, dof);
    if (!motion) return std::nullopt;
    double squares = 0;
    for (std::size_t i = 0; i < from.size(); ++i)
      squares += std::pow(stem_distance(*motion * from[i], to[i], horizontal), 2);
    return std::pair(*motion, std::sqrt(squares / double(from.size())));
  }

 private:
  Eigen::Vector3d compared(const Eigen::Vector3d& p) const {
    return {p.x(), p.y(), horizontal ? 0.0 : p.z()};
  }

  neighbor_tree<double, 3> target_tree_;
};

/// Drops the correspondence that fits worst until all lie within `tolerance` [m] of each other.
inline std::vector<correspondence> drop_misfits(const map_pair& maps, std::span<const correspondence> start,
                                                double tolerance) {
  std::vector<correspondence> pairs(start.begin(), start.end());
  while (const auto fitted = maps.fit(pairs)) {
    const auto misfit = [&](const correspondence& c) {
      return stem_distance(fitted->first * maps.source.at[c.source], maps.target.at[c.target],
                           maps.horizontal);
    };
    const auto worst = std::max_element(
        pairs.begin(), pairs.end(),
        [&](const correspondence& a, const correspondence& b) { return misfit(a) < misfit(b); });
    if (misfit(*worst) < tolerance) break;
    pairs.erase(worst);
  }
  return pairs;
}

/// Pairs all stems under the motion that most of `start` agree on, and fits it anew until the pairs stand.
/// Nothing when fewer than three pairs are left.
inline std::optional<hypothesis> verify(const map_pair& maps, std::span<const correspondence> start,
                                        double tolerance) {
  constexpr int rounds = 20;
  std::vector<correspondence> pairs = drop_misfits(maps, start, tolerance);
  hypothesis h;
  h.tolerance = tolerance;
  for (int round = 0; round < rounds; ++round) {
    const auto fitted = maps.fit(pairs);
    if (!fitted) return std::nullopt;
    h.target_from_source = fitted->first;
    h.correspondences = maps.pair_stems(h.target_from_source, tolerance);
    if (h.correspondences == pairs) break;
    pairs = h.correspondences;
  }
  if (h.correspondences.size() < 3) return std::nullopt;
  double squares = 0;
  for (const correspondence& c : h.correspondences)
    squares += std::pow(stem_distance(h.target_from_source * maps.source.at[c.source],
                                      maps.target.at[c.target], maps.horizontal),
                        2);
  h.rms = std::sqrt(squares / double(h.correspondences.size()));
  return h;
}

/// Whether two hypotheses lay the source stems paired by either at places that differ by more than `distance`
/// [m] on average: they then are rivals and not two views of one motion.
inline bool differ(const hypothesis& a, const hypothesis& b, const position_set& source, double distance) {
  double sum = 0;
  std::size_t count = 0;
  for (const hypothesis* h : {&a, &b})
    for (const correspondence& c : h->correspondences) {
      const Eigen::Vector3d& p = source.at[c.source];
      sum += (a.target_from_source * p - b.target_from_source * p).norm();
      ++count;
    }
  return count == 0 || sum > distance * double(count);
}

}  // namespace globalmatch

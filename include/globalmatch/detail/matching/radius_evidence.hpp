// Evidence of radii: a stem has in both maps the radius that it has. In: hypotheses, and the radii of stems.
// Out: how improbable it is that the radii of paired stems agree as well if the maps have nothing in common.
// Ours.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "globalmatch/detail/core/neighbor.hpp"
#include "globalmatch/detail/core/position_index.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/evidence.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// For natural stands; `lattice_residuals` has the radii of plantations. Refers to the maps.
class radius_evidence {
 public:
  explicit radius_evidence(const matching_context& context) : context_(context) {}

  bool is_known() const { return !context_.source.radius.empty() && !context_.target.radius.empty(); }

  /// None: it proposes nothing.
  std::vector<local_hypothesis> propose(std::size_t) const { return {}; }

  /// The NFA of positions and radii together, which are independent if maps have nothing in common.
  evidence_score score(const local_hypothesis& h) const {
    return {with_independent(h.log10_nfa, log10_probability(h), 1), evidence_source::radii,
            h.log10_nfa_poisson};
  }

  /// Of the radii of paired stems agreeing as well, if the maps have nothing in common. Either map may be the
  /// one whose radii grow in some direction: the less improbable of both counts. 0 where nothing is known.
  double log10_probability(const local_hypothesis& h) const {
    if (!is_known()) return 0;
    return std::max(log_probability(h, context_.target, *context_.target_index, true),
                    log_probability(h, context_.source, *context_.source_index, false)) /
           std::numbers::ln10;
  }

 private:
  /// Null model: any of the stems around a stem of `map` may as well be in its place. The share of these
  /// whose radius agrees as well is uniform between 0 and 1 then. It counts by how much it is below one half:
  /// a few stems that are paired wrongly hide no agreement of the others.
  double log_probability(const local_hypothesis& h, const position_set& map, const position_index& index,
                         bool is_target) const {
    constexpr double half = 0.5;
    double agreement = 0, pairs = 0;
    std::vector<neighbor<double>> around;
    for (const correspondence& c : h.correspondences) {
      poll_cancelled();
      const stem_index paired = is_target ? c.target : c.source;
      const double other = is_target ? context_.source.radius[c.source] : context_.target.radius[c.target];
      if (!(other > 0 && map.radius[paired] > 0)) continue;
      const double share = share_that_agrees(map, index, paired, other, around);
      agreement += std::max(0.0, 1 - share / half);
      ++pairs;
    }
    return log_uniform_sum_tail(agreement, pairs, half);
  }

  /// Of a stem and those around it, the share whose radii differ no more from `radius` [m] than its own does.
  static double share_that_agrees(const position_set& map, const position_index& index, stem_index stem,
                                  double radius, std::vector<neighbor<double>>& around) {
    constexpr std::size_t neighbors = 20;  // as triangles have, [GM] 3.2.1
    const double difference = std::abs(map.radius[stem] - radius);
    index.nearest(stem, neighbors, around);
    std::size_t known = 1, as_near = 1;
    for (const neighbor<double>& n : around) {
      if (!(map.radius[n.index] > 0)) continue;
      ++known;
      as_near += std::abs(map.radius[n.index] - radius) <= difference;
    }
    return double(as_near) / double(known);
  }

  const matching_context& context_;
};

static_assert(evidence<radius_evidence>);

}  // namespace globalmatch::detail

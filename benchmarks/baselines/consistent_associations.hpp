// All associations of two stem maps, and which pairs of them are consistent: what methods that look for
// cliques of associations start from. An association pairs a source with a target stem; two are consistent
// where the lengths between their stems agree in plan.
#pragma once

#include "baselines/stem_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace globalmatch::benchmarks {

/// Associations are numbered: source stem times the target stems, plus the target stem.
class consistent_associations {
 public:
  explicit consistent_associations(const stem_alignment& maps) : maps_(maps) {
    for (stem_index a = 0; a < maps.target.size(); ++a)
      for (stem_index b = a + 1; b < maps.target.size(); ++b)
        lines_.push_back({(maps.target.at[a] - maps.target.at[b]).xy().norm(), a, b});
    std::sort(lines_.begin(), lines_.end(), [](const line& a, const line& b) { return a.length < b.length; });
  }

  std::size_t size() const { return maps_.source.size() * maps_.target.size(); }

  correspondence operator[](std::size_t association) const {
    return {stem_index(association / maps_.target.size()), stem_index(association % maps_.target.size())};
  }

  /// How many pairs are consistent. Cost: linear in the source lines, and logarithmic in those of the target.
  std::size_t count() const {
    std::size_t pairs = 0;
    for_each_source_line(
        [&](stem_index, stem_index, double, std::span<const line> like) { pairs += 2 * like.size(); });
    return pairs;
  }

  /// Calls `visit(smaller association, larger one, difference of their lengths [m])` for each consistent
  /// pair.
  template <class Visit>
  void for_each_pair(const Visit& visit) const {
    const std::size_t targets = maps_.target.size();
    for_each_source_line([&](stem_index i, stem_index j, double length, std::span<const line> like) {
      for (const line& l : like) {
        const double difference = std::abs(l.length - length);
        visit(i * targets + l.a, j * targets + l.b, difference);
        visit(i * targets + l.b, j * targets + l.a, difference);
      }
    });
  }

 private:
  struct line {
    double length;
    stem_index a, b;
  };

  /// Calls `visit(i, j, length, target lines as long)` for all i < j.
  template <class Visit>
  void for_each_source_line(const Visit& visit) const {
    const auto shorter = [](const line& l, double length) { return l.length < length; };
    for (stem_index i = 0; i < maps_.source.size(); ++i) {
      poll_cancelled();
      for (stem_index j = i + 1; j < maps_.source.size(); ++j) {
        const double length = (maps_.source.at[i] - maps_.source.at[j]).xy().norm();
        const auto begin =
            std::lower_bound(lines_.begin(), lines_.end(), length - maps_.inlier_threshold, shorter);
        const auto end = std::lower_bound(begin, lines_.end(), length + maps_.inlier_threshold, shorter);
        visit(i, j, length, std::span(begin, end));
      }
    }
  }

  const stem_alignment& maps_;
  std::vector<line> lines_;  // of the target, by length
};

/// The transform of a clique of associations.
inline std::optional<Eigen::Isometry3d> transform_of(const stem_alignment& maps,
                                                     const std::vector<correspondence>& clique) {
  scored_transform best;
  maps.keep_better(clique, best);
  return maps.refined(best);
}

/// What a search for a clique of associations makes of two maps: `search(alignment, associations, exec)`
/// gives the numbers of its associations, or nothing where the maps are too large for it. It cannot be
/// stopped: one that took too long counts as stopped in the end.
template <class Search>
match_run match_by_clique(const two_maps& maps, const run_limits& limits, double inlier_threshold,
                          const Search& search) {
  const stem_alignment alignment(maps, inlier_threshold);
  match_run run = run_within(limits, 0, [&](const execution& exec) {
    match_run result{.funnel = alignment.funnel()};
    const consistent_associations associations(alignment);
    const std::optional<std::vector<int>> nodes = search(alignment, associations, exec);
    result.stopped = !nodes;
    if (result.stopped) return result;
    std::vector<correspondence> clique;
    for (const int node : *nodes) clique.push_back(associations[std::size_t(node)]);
    result.funnel.consensus = clique.size();
    result.target_from_source = transform_of(alignment, clique);
    return result;
  });
  if (run.seconds > limits.seconds) run.stopped = true, run.target_from_source.reset();
  return run;
}

}  // namespace globalmatch::benchmarks

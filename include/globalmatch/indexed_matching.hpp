// Indexed proposal: motions from triangles that look alike, tried on the stems around them. In: two maps, one
// of them indexed. Out: distinct hypotheses, verified over all stems. Cost: a fixed number of queries, each
// with as many candidates as there are triangles that look alike.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/execution.hpp"
#include "globalmatch/hypothesis.hpp"
#include "globalmatch/neighbors.hpp"
#include "globalmatch/plan_index.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/random.hpp"
#include "globalmatch/significance.hpp"
#include "globalmatch/transform.hpp"
#include "globalmatch/triangle_index.hpp"
#include "globalmatch/triangles.hpp"

namespace globalmatch {

struct indexed_matching_options {
  int target_neighbors = 5;      ///< stems around each target stem that make triangles of the index (ours)
  int source_neighbors = 8;      ///< stems around a source stem that make triangles to query (ours)
  std::size_t few_stems = 100;   ///< maps of so many are searched patiently (ours) ...
  std::size_t some_stems = 300;  ///< ... and those of so many when nothing else was found (ours)
  int neighbors_of_few = 20;     ///< instead of both where a map has 100 stems or fewer ([GM] 3.2.1: K = 20)
  int tried_neighbors = 40;      ///< stems around a triangle that a motion is tried on (ours)
  double enough = -10;           ///< log10 of false alarms at which no further tolerance is tried (ours)
  std::size_t most_queries = 20000;          ///< source triangles looked up (ours)
  std::size_t most_candidates = 20'000'000;  ///< motions tried (ours)
  std::size_t queries_for_rivals = 200;      ///< at least so many, though the first is found (ours)
  std::size_t most_hypotheses = 16;          ///< distinct ones that are remembered and returned (ours)
  std::uint64_t seed = 1;                    ///< of the order of queries
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const indexed_matching_options& options) {
  const auto require = [](bool holds, const char* message) {
    if (!holds) throw std::invalid_argument(message);
  };
  require(options.target_neighbors >= 2, "indexed.target_neighbors must be at least 2");
  require(options.source_neighbors >= 2, "indexed.source_neighbors must be at least 2");
  require(options.neighbors_of_few >= 2, "indexed.neighbors_of_few must be at least 2");
  require(options.most_hypotheses >= 2, "indexed.most_hypotheses must be at least 2");
  require(options.tried_neighbors >= std::max(options.source_neighbors, options.neighbors_of_few),
          "indexed.tried_neighbors must be at least source_neighbors and neighbors_of_few");
}

namespace detail {

/// A motion and how many of the stems around its triangle it lays on stems.
struct trial {
  std::array<correspondence, 3> triangle;
  std::size_t hits = 0;
};

/// Tries motions on the stems around a source stem.
class motion_trial {
 public:
  motion_trial(const map_pair& maps, double tolerance, bool patient)
      : maps_(maps), reach_(2 * tolerance), patient_(patient) {}

  /// Of `around`, nearest first, how many the triangle's motion lays on target stems; nothing when so few of
  /// the first ones that the rest is not worth it.
  std::optional<std::size_t> count_hits(const std::array<correspondence, 3>& triangle,
                                        std::span<const stem_index> around) const {
    constexpr std::size_t look = 8, least_share = 5;  // one in five, told after every eight
    const auto motion = maps_.fit(triangle);
    if (!motion) return std::nullopt;
    for (const correspondence& c : triangle)
      if (maps_.misfit(*motion, c) > reach_ ||
          !maps_.heights_agree(*motion * maps_.source.at[c.source], c.target))
        return std::nullopt;
    std::size_t tried = 0, hits = 0;
    for (const stem_index s : around) {
      if (std::any_of(triangle.begin(), triangle.end(), [&](const auto& c) { return c.source == s; }))
        continue;
      bool hit = false;
      maps_.for_each_met(*motion * maps_.source.at[s], reach_, [&](stem_index, double) { hit = true; });
      hits += hit;
      ++tried;
      if (!patient_ && tried % look == 0 && hits * least_share < tried) return std::nullopt;
    }
    return hits;
  }

 private:
  const map_pair& maps_;
  double reach_;
  bool patient_;
};

/// Source stems in an order of its own for each seed, so that queries come from all over the map.
inline std::vector<stem_index> shuffled_stems(std::size_t count, std::uint64_t seed) {
  std::vector<stem_index> order(count);
  std::iota(order.begin(), order.end(), stem_index(0));
  random_source random(seed);
  for (std::size_t i = count; i > 1; --i)
    std::swap(order[i - 1], order[random.below(static_cast<std::uint32_t>(i))]);
  return order;
}

}  // namespace detail

inline namespace GLOBALMATCH_THREADING {

/// Distinct hypotheses, verified over all stems at `tolerance` [m] and judged against chance, best first.
/// `source_plan` is that of the source stems, `index` that of the target's triangles. `patient`: every motion
/// is tried on all stems around it, and more triangles are queried, as maps that share only few stems need.
inline std::vector<hypothesis> match_by_index(const map_pair& maps, const plan_index& source_plan,
                                              const triangle_index& index, double tolerance,
                                              const chance& by_chance, std::span<const double> tolerances,
                                              const indexed_matching_options& options, bool patient,
                                              matching_funnel& funnel, const execution& how = {}) {
  const std::size_t best_of_query = patient ? 8 : 2;  // tried on all stems
  const detail::motion_trial trial(maps, tolerance, patient);
  const double flattest = 2 * tolerance;  // [m] a flatter triangle hardly fixes a turn

  std::vector<hypothesis> hypotheses;
  std::size_t queries = 0, candidates = 0;
  bool found = false;
  std::vector<neighbor<double>> nearest;
  std::vector<stem_index> around;
  std::vector<detail::trial> trials;
  for (const stem_index i : detail::shuffled_stems(maps.source.size(), options.seed)) {
    if (found && queries >= options.queries_for_rivals) break;
    if (queries >= options.most_queries || candidates >= options.most_candidates) break;
    report_progress(how, "matching", double(queries) / double(options.most_queries));
    source_plan.nearest(i, std::size_t(options.tried_neighbors), nearest);
    around.clear();
    for (const auto& n : nearest) around.push_back(n.index);
    const std::size_t corners =
        std::min(around.size(), std::size_t(patient ? options.neighbors_of_few : options.source_neighbors));
    trials.clear();
    for (std::size_t j = 0; j < corners; ++j)
      for (std::size_t k = j + 1; k < corners; ++k) {
        const triangle t = make_triangle(maps.source, {i, around[j], around[k]}, maps.in_plan());
        if (t.plan_height < flattest) continue;
        ++queries;
        for_each_admissible_order(t, tolerance, [&](const triangle& ordered) {
          index.for_each_like(ordered, tolerance, [&](const std::array<stem_index, 3>& like) {
            ++candidates;
            const std::array<correspondence, 3> corresponding = {{{ordered.vertices[0], like[0]},
                                                                  {ordered.vertices[1], like[1]},
                                                                  {ordered.vertices[2], like[2]}}};
            if (std::any_of(hypotheses.begin(), hypotheses.end(),
                            [&](const hypothesis& h) { return leads_to(corresponding, h, maps); }))
              return;
            if (const auto hits = trial.count_hits(corresponding, around))
              trials.push_back({corresponding, *hits});
          });
        });
      }
    std::stable_sort(trials.begin(), trials.end(),
                     [](const detail::trial& a, const detail::trial& b) { return a.hits > b.hits; });
    std::size_t verified = 0;
    for (const detail::trial& best : trials) {
      if (verified == best_of_query) break;
      if (std::any_of(hypotheses.begin(), hypotheses.end(),
                      [&](const hypothesis& h) { return leads_to(best.triangle, h, maps); }))
        continue;
      ++verified;
      auto h = verify(maps, best.triangle, tolerance);
      if (!h) continue;
      weigh(*h, maps, by_chance, tolerances);
      found = found || h->log10_false_alarms < options.enough;
      add_distinct(std::move(*h), hypotheses, maps);
      if (hypotheses.size() == 2 * options.most_hypotheses) keep_best(hypotheses, options.most_hypotheses);
    }
  }
  funnel.source_triangles += queries;
  funnel.target_triangles = index.size();
  funnel.local_pairs += candidates;
  keep_best(hypotheses, options.most_hypotheses);
  return hypotheses;
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace globalmatch

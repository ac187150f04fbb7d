// Options of stem matching ([GM] 3.2).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "globalmatch/detail/core/rigid_fit.hpp"
#include "globalmatch/global_matching.hpp"
#include "globalmatch/triangles.hpp"

namespace globalmatch {

/// How hypotheses come about.
enum class proposal {
  triangle_index,  ///< triangles look their likes up; for maps of any size (ours)
  algorithm_1      ///< largest consensus set of all congruent triangles, [GM] 3.2; for some hundred stems
};

struct indexed_matching_options {
  int target_neighbors = 5;  ///< stems around each target stem that make triangles of the index (ours)
  int source_neighbors = 8;  ///< stems around a source stem that make triangles to query (ours)
  std::size_t exhaustive_max_stems = 100;  ///< maps of so many are searched patiently (ours) ...
  std::size_t retry_max_stems = 300;       ///< ... and those of so many when nothing else was found (ours)
  std::size_t sufficient_stems =
      20000;                      ///< larger maps share enough triangles when so many stems make them (ours)
  int exhaustive_neighbors = 20;  ///< instead of both where a map has 100 stems or fewer ([GM] 3.2.1: K = 20)
  int trial_neighbors = 40;       ///< stems around a triangle that a motion is tried on (ours)
  std::size_t max_trials =
      400;  ///< motions that are tried for each source stem, those of most triangles first (ours)
  double sufficient_log10_nfa =
      -10;  ///< log10 of false alarms at which nothing further is tried or asked (ours)
  std::size_t max_queries = 20000;         ///< source triangles looked up (ours)
  std::size_t max_candidates = 5'000'000;  ///< target triangles found alike, in all (ours)
  std::size_t stems_for_alternatives =
      5;                            ///< whose triangles are looked up at least, though one is found (ours)
  std::size_t max_hypotheses = 16;  ///< distinct ones that are remembered and returned (ours)
  std::uint64_t seed = 1;           ///< of the order of queries
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const indexed_matching_options& options) {
  const auto require = [](bool holds, const char* message) {
    if (!holds) throw std::invalid_argument(message);
  };
  require(options.target_neighbors >= 2, "indexed.target_neighbors must be at least 2");
  require(options.source_neighbors >= 2, "indexed.source_neighbors must be at least 2");
  require(options.exhaustive_neighbors >= 2, "indexed.exhaustive_neighbors must be at least 2");
  require(!std::isnan(options.sufficient_log10_nfa), "indexed.enough must be a number");
  require(options.max_hypotheses >= 2, "indexed.max_hypotheses must be at least 2");
  require(options.sufficient_stems >= 1, "indexed.sufficient_stems must be at least 1");
  require(options.max_trials >= 1, "indexed.max_trials must be at least 1");
  require(options.trial_neighbors >= std::max(options.source_neighbors, options.exhaustive_neighbors),
          "indexed.trial_neighbors must be at least source_neighbors and exhaustive_neighbors");
}

struct decision_options {
  int min_correspondences = 4;  ///< stems in both maps (ours)
  double min_minor_axis_sigma =
      0.5;  ///< [m] standard deviation of these across the line they lie nearest to (ours)
  /// Motions that chance would make pair as many stems: fewer are expected of one that is to be trusted
  /// (ours).
  double max_nfa = 1e-3;
  /// A rival whose logarithm of false alarms is at least this share of the best one's makes it ambiguous
  /// (ours).
  double alternative_share = 0.5;
  /// [rad] Heights of paired stems that slope by more, beyond doubt, tell of a scan that was not levelled:
  /// 4-DoF cannot mend that. Instruments level themselves to hundredths of a degree, so 1 degree is no noise
  /// (ours).
  double max_tilt = std::numbers::pi / 180;
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const decision_options& options) {
  if (options.min_correspondences < 3)
    throw std::invalid_argument("decision.min_correspondences must be at least 3");
  if (!(options.min_minor_axis_sigma >= 0))
    throw std::invalid_argument("decision.min_minor_axis_sigma must not be negative");
  if (!(options.max_nfa > 0)) throw std::invalid_argument("decision.max_nfa must be positive");
  if (!(options.alternative_share > 0 && options.alternative_share <= 1))
    throw std::invalid_argument("decision.alternative_share must lie in (0, 1]");
  if (!(options.max_tilt >= 0)) throw std::invalid_argument("decision.max_tilt must not be negative");
}

struct matching_options {
  degrees_of_freedom dof = degrees_of_freedom::four;  ///< ([GM] 3.3 prefers four for levelled scans)
  bool horizontal = false;  ///< ignore heights; always so when a map has none (ours)
  /// [m] epsilon: edges of congruent triangles differ by less, and paired stems lie closer ([GM] 3.2.2:
  /// 0.05), in plan in 4-DoF (but for the edges of `algorithm_1`). Empty: the one at which the pairs are
  /// least explainable by chance, or a wider one where three standard deviations of the residuals reach
  /// further.
  std::optional<double> inlier_threshold = {};
  /// [m] in 4-DoF the heights of paired stems differ by less: where the ground is hidden, by shrubs or in a
  /// hollow, they are off by decimetres (ours)
  double vertical_threshold = 1;
  globalmatch::proposal proposal = proposal::triangle_index;
  indexed_matching_options indexed = {};
  triangle_options triangles = {};      ///< of `algorithm_1`
  global_matching_options global = {};  ///< of `algorithm_1`
  decision_options decision = {};
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const matching_options& options) {
  if (options.inlier_threshold &&
      !(*options.inlier_threshold > 0 && std::isfinite(*options.inlier_threshold)))
    throw std::invalid_argument("inlier_threshold must be positive and finite");
  if (!(options.vertical_threshold > 0)) throw std::invalid_argument("vertical_threshold must be positive");
  if (options.dof != degrees_of_freedom::four && options.dof != degrees_of_freedom::six)
    throw std::invalid_argument("dof must be four or six");
  if (options.horizontal && options.dof == degrees_of_freedom::six)
    throw std::invalid_argument("horizontal: six degrees of freedom need heights");
  require_valid(options.indexed);
  require_valid(options.triangles);
  require_valid(options.global);
  require_valid(options.decision);
}

}  // namespace globalmatch

// Background density: how densely the stems of a map stand, and whether in a regular plantation. In: a stem
// map. Out: the probability that a random place among them is near one.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/neighbor.hpp"
#include "globalmatch/detail/core/position_index.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// Larger of the extents [m] of a map along x and y, outliers aside.
inline double extent(const position_set& stems) {
  return std::max(middle_extent(stems, 0), middle_extent(stems, 1)) / middle_share;
}

/// Radius [m] of a circle as large as the cells [m^2] of places in steps. Places of two maps that are noted
/// in equal steps coincide, once one of them does: as often as if they were within the circle, and within a
/// distance of each other at most as often as within a circle that is wider by this.
inline double step_of(double cell_area) {
  return std::sqrt(cell_area / std::numbers::pi);
}

/// Of the stems of one map. Immutable.
class background_density {
 public:
  /// `index` is that of `stems`. Cost: linear in the stems for the extent, the rest looks at some of them.
  background_density(const position_set& stems, std::shared_ptr<const position_index> index)
      : index_(std::move(index)), extent_(detail::extent(stems)), step_(step_of(stems.cell_area)) {
    constexpr std::size_t neighbors = 6, max_visited = 1024;
    const std::size_t size = stems.size(), k = std::min(neighbors, size - std::min<std::size_t>(size, 1));
    const std::size_t step = (size + max_visited - 1) / max_visited;
    std::vector<neighbor<double>> nearest;
    for (std::size_t i = 0; k >= 2 && i < size; i += step) {
      poll_cancelled();
      index_->nearest(i, k, nearest);
      const double area = std::numbers::pi * nearest.back().squared_distance;
      densities_.push_back(area > 0 ? double(k - 1) / area : std::numeric_limits<double>::infinity());
    }
    if (densities_.empty()) return;
    std::vector<double> reordered = densities_;
    stem_radius_ = 1 / std::sqrt(std::numbers::pi * median(reordered));
    find_lattice(stems);
  }

  /// [m] as the free function.
  double extent() const { return extent_; }
  /// Radius [m] of the circle that one stem has to itself, typically; 0 in maps of fewer than three stems.
  double stem_radius() const { return stem_radius_; }

  /// Probability that an unrelated stem is within `inlier_threshold` [m] of one: the mean over
  /// places of stems, so that it is not too small where these stand in clumps; and not less than what the map
  /// shows when it is shifted from stem to stem, so that a plantation explains its own lattice. Heights,
  /// which would make it smaller, are left out. 1 in maps of fewer than three stems.
  double inlier_probability(double inlier_threshold) const {
    if (densities_.empty()) return 1;
    return std::max(poisson_inlier_probability(inlier_threshold),
                    lattice_inlier_probability(inlier_threshold));
  }

  /// The same if stems stood at random.
  double poisson_inlier_probability(double inlier_threshold) const {
    double sum = 0;
    for (const double density : densities_)
      sum += -std::expm1(-density * std::numbers::pi * inlier_threshold * inlier_threshold);
    return densities_.empty() ? 1 : sum / double(densities_.size());
  }

  /// The same along the lattice; 0 where the map has none. Of the stems within a wider radius at least as
  /// many as of an evenly filled disc are nearer: few shifts can be looked at, and what they do not show at
  /// centimetres they may show at decimetres.
  double lattice_inlier_probability(double inlier_threshold) const {
    // The shift of `find_lattice`, from one stem to another, is as uncertain as each residual: a transform
    // that aligns two lattices is better by the root of two.
    const double wider = std::numbers::sqrt2 * inlier_threshold;
    double p = lattice_.empty() ? 0 : likely_share_within(wider);
    for (const repeats& r : lattice_)
      p = std::max(p, r.share * std::min(1.0, (wider / r.distance) * (wider / r.distance)));
    return p;
  }

  /// Whether stems repeat at some shifts more often than at random.
  bool has_lattice() const { return !lattice_.empty(); }

  /// Whether stems stand around a place: within `surroundings` [m].
  bool surrounds(const vec3& place) const { return index_->any_within(place.x, place.y, surroundings()); }
  double surroundings() const { return surroundings_factor * stem_radius_; }

 private:
  static constexpr double surroundings_factor = 3;  // stem radii: a circle that holds nine stems
  static constexpr double pair_multiplicity =
      4;  // two congruent pairs of stems match as each is shifted to the other, and back

  static constexpr double min_distance = 0.03;                                     // [m]
  static constexpr std::size_t distance_count = 12, classes = distance_count + 2;  // up to twice as far
  static double distance_of(std::size_t i) { return min_distance * std::pow(2, 0.5 * double(i)); }
  /// The first of these that a distance is less than, by its square [m^2].
  static std::size_t class_of(double squared) {
    const double doublings = squared / (min_distance * min_distance);
    return doublings < 1 ? 0 : std::min(std::size_t(std::ilogb(doublings)) + 1, classes - 1);
  }

  /// Residuals of a map that is shifted onto itself.
  struct autocorrelation {
    double trials = 0;             ///< stems shifted to places that other stems surround
    std::vector<double> nearest;   ///< [m] from these to the nearest stem, where one is near
    double matched[classes] = {};  ///< stems that another is within each distance of
    double all[classes] = {};      ///< all stems within each distance
  };

  /// Finds within which distance more stems match another one than under the null model, when the map is
  /// shifted from stems to their nearest ones. Chance is a random map, and one that is as dense just beyond
  /// that distance: clumps stay clumps a little aside, rows leave the ground beside them empty.
  void find_lattice(const position_set& stems) {
    constexpr double significance_level = 1e-6;
    autocorrelation own = autocorrelate(stems);
    for (std::size_t i = 0; i < distance_count; ++i) {
      const double beside = (own.all[i + 2] - own.all[i]) / 3;  // up to twice as far, on thrice the area
      const double expected_share =
          std::max(poisson_inlier_probability(distance_of(i) + step_), -std::expm1(-beside / own.trials));
      if (own.matched[i] > 0 &&
          log_binomial_tail(own.matched[i] / pair_multiplicity, own.trials / pair_multiplicity,
                            expected_share) < std::log(significance_level))
        lattice_.push_back({distance_of(i), own.matched[i] / own.trials});
    }
    if (lattice_.empty()) return;
    tries_ = own.trials;
    residuals_ = std::move(own.nearest);
    sort_numbers(residuals_);
  }

  /// Of the stems that were shifted onto the map itself those with another within `distance` [m].
  double share_within(double distance) const {
    const auto matched =
        std::lower_bound(residuals_.begin(), residuals_.end(), distance) - residuals_.begin();
    return tries_ > 0 ? double(matched) / tries_ : 0;
  }

  /// The share that may be behind it: two standard deviations above.
  double likely_share_within(double distance) const {
    const double share = share_within(distance);
    return std::min(1.0, share + 2 * std::sqrt(share * (1 - share) * pair_multiplicity / tries_));
  }

  autocorrelation autocorrelate(const position_set& stems) const {
    constexpr std::size_t origins = 8, shifts = 4, max_stems = 32;
    const std::vector<vec3>& at = stems.at;
    autocorrelation own;
    if (at.size() < origins) return own;
    const std::size_t origin_step = at.size() / origins, step = (at.size() + max_stems - 1) / max_stems;
    std::vector<neighbor<double>> nearest;
    for (std::size_t o = 0; o < origins * origin_step; o += origin_step) {
      poll_cancelled();
      index_->nearest(o, shifts, nearest);
      for (const auto& n : nearest) {
        const vec3 shift = at[n.index] - at[o];
        for (std::size_t i = 0; i < at.size(); i += step)
          if (i != o)  // which gave the shift
            accumulate(at[i] + shift, stem_index(i), own);
      }
    }
    for (std::size_t i = 1; i < classes; ++i) {
      own.matched[i] += own.matched[i - 1];
      own.all[i] += own.all[i - 1];
    }
    return own;
  }

  /// Counts the stems around a place that stem `itself` was shifted to, but not itself, by rings.
  void accumulate(const vec3& place, stem_index itself, autocorrelation& own) const {
    constexpr double max_mean_offset = 0.35;  // radii: half a circle of stems has its mean at 0.42
    const double distance = distance_of(classes - 1),
                 radius = std::max(distance, surroundings_factor * stem_radius_);
    double nearest = distance * distance, count = 0;
    vec2 sum = vec2{};
    double ring[classes] = {};
    index_->for_each_within(place.x, place.y, radius, [&](stem_index j, double squared) {
      sum += index_->at(j) - place.xy();
      ++count;
      if (j == itself || squared >= distance * distance) return;
      nearest = std::min(nearest, squared);
      ++ring[class_of(squared)];
    });
    if (count == 0 || sum.norm() >= max_mean_offset * radius * count) return;
    for (std::size_t i = 0; i < classes; ++i) own.all[i] += ring[i];
    ++own.trials;
    if (nearest >= distance * distance) return;
    ++own.matched[class_of(nearest)];
    own.nearest.push_back(std::sqrt(nearest));
  }

  std::shared_ptr<const position_index> index_;
  double extent_ = 0, stem_radius_ = 0;  // [m]
  double step_ = 0;                      // [m], see `step_of`
  std::vector<double> densities_;        // [1 / m^2] around some of the stems
  std::vector<double> residuals_;        // [m] of the map shifted onto itself, increasing
  double tries_ = 0;                     // stems that were shifted for them
  struct repeats {
    double distance, share;  // [m], and of the shifted stems those with another within
  };
  std::vector<repeats> lattice_;
};

}  // namespace globalmatch::detail

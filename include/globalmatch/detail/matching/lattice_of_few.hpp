// Planting lattice of few stems: so few that the map does not repeat at its shifts often enough to be sure.
// In: a stem map. Out: how near its stems are to the places of the lattice that fits them best. Ours.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/core/neighbor.hpp"
#include "globalmatch/detail/core/position_index.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// How stems stand about the places of a lattice.
struct lattice_of_few {
  double occupied = 0;  ///< share of the places among the stems that have one
  double sigma = 0;     ///< [m] per coordinate, of stems from their places

  /// The larger, the more stems are near places of a lattice that has few others.
  double explains() const { return occupied > 0 ? occupied / (sigma * sigma) : 0; }

  /// Probability that a stem of an unrelated map on an equal lattice is within `inlier_threshold` [m] of one,
  /// once the lattices are aligned: both are as far off their places.
  double inlier_probability(double inlier_threshold) const {
    const double in_sigmas = inlier_threshold / sigma;
    return occupied > 0 ? -occupied * std::expm1(-in_sigmas * in_sigmas / 4) : 0;
  }
};

/// Fits lattices to stems, all of them at once, from three that span a cell.
class few_stems_fit {
 public:
  explicit few_stems_fit(const position_index& index) : index_(index) {}

  /// The stems about the lattice that has `first` and `second` next to `origin`; nothing where these are in a
  /// line, or too few stems are near its places.
  lattice_of_few around(std::size_t origin, std::size_t first, std::size_t second) {
    constexpr double min_sine = 0.3;  // of the cell's angle
    start_ = at(origin);
    cell_ = {{at(first) - start_, at(second) - start_}};
    const double area = std::abs(cell_.determinant());
    if (!(area > min_sine * cell_.columns[0].norm() * cell_.columns[1].norm())) return {};
    constexpr double max_residual = 0.25;  // of the cell's width
    if (!refit(max_residual * std::sqrt(area))) return {};
    return about_places();
  }

 private:
  const vec2& at(std::size_t i) const { return index_.at(stem_index(i)); }

  /// In cells, from the start.
  vec2 place_of(const vec2& stem) const {
    const vec2 in_cells = cell_.inverse() * (stem - start_);
    return {std::round(in_cells.x), std::round(in_cells.y)};
  }
  vec2 residual(const vec2& stem) const { return stem - start_ - cell_ * place_of(stem); }

  /// Least squares over the stems that are within `max_residual` [m] of their places.
  bool refit(double max_residual) {
    mat3 normal;
    vec3 right_x, right_y;
    for (std::size_t i = 0; i < index_.size(); ++i) {
      if (residual(at(i)).norm() > max_residual) continue;
      const vec2 place = place_of(at(i));
      const vec3 row{1, place.x, place.y};
      normal += outer(row, row);
      right_x += at(i).x * row;
      right_y += at(i).y * row;
    }
    if (!normal.is_invertible()) return false;
    const vec3 x = normal.inverse() * right_x, y = normal.inverse() * right_y;
    start_ = {x.x, y.x};
    cell_ = {{{x.y, y.y}, {x.z, y.z}}};
    return std::abs(cell_.determinant()) > 0;
  }

  /// By most of the stems: some may be on no place.
  lattice_of_few about_places() {
    constexpr double most = 0.8, square_of_most = 3.219;  // of two normal coordinates
    constexpr double fitted = 3;                          // stems that a lattice always fits
    const double count = double(index_.size());
    squares_.clear();
    vec2 low{}, high{};
    for (std::size_t i = 0; i < index_.size(); ++i) {
      squares_.push_back(residual(at(i)).squared_norm());
      const vec2 place = place_of(at(i));
      low = {std::min(low.x, place.x), std::min(low.y, place.y)};
      high = {std::max(high.x, place.x), std::max(high.y, place.y)};
    }
    const double places = (high.x - low.x + 1) * (high.y - low.y + 1);
    const double of_most = nth_smallest(squares_, std::size_t(std::ceil(most * count)) - 1);
    constexpr double min_sigma = 1e-3;  // [m] no stem is planted better
    return {std::min(1.0, count / places),
            std::max(min_sigma, std::sqrt(of_most / square_of_most * count / (count - fitted)))};
  }

  const position_index& index_;
  vec2 start_;
  mat2 cell_;
  std::vector<double> squares_;
};

/// The lattice that explains most of few stems. Cost: quadratic in the stems.
inline lattice_of_few best_lattice(const position_index& index) {
  constexpr std::size_t neighbors = 6;
  lattice_of_few best;
  few_stems_fit fit(index);
  std::vector<neighbor<double>> nearest;
  for (std::size_t origin = 0; origin < index.size(); ++origin) {
    poll_cancelled();
    index.nearest(origin, neighbors, nearest);
    for (std::size_t a = 0; a < nearest.size(); ++a)
      for (std::size_t b = 0; b < a; ++b) {
        const lattice_of_few found = fit.around(origin, nearest[a].index, nearest[b].index);
        if (found.explains() > best.explains()) best = found;
      }
  }
  return best;
}

/// Stems that are each moved to any place nearer than `distance` [m].
inline position_set scattered(const position_set& stems, double distance, random_source& random) {
  position_set moved;
  for (const vec3& p : stems.at) {
    const double direction = 2 * std::numbers::pi * random.uniform(),
                 far = distance * std::sqrt(random.uniform());
    moved.at.push_back(p + vec3{far * std::cos(direction), far * std::sin(direction), 0});
  }
  return moved;
}

/// The lattice that few stems are probably planted on: it explains more of them than of nearly all of some
/// maps whose stems are as many, as densely, at random. None (nothing is occupied) where it does not, of
/// fewer stems than four, or of so many that they show it when they are shifted. Cost: quadratic in the
/// stems.
inline lattice_of_few find_lattice_of_few(const position_set& stems) {
  constexpr std::size_t min_stems = 4, max_stems = 24, random_maps = 19, may_explain_more = 2;
  constexpr double displacement = 0.6;  // of the spacing: a lattice is lost, and the map hardly larger
  if (stems.size() < min_stems || stems.size() > max_stems) return {};
  const position_index index(stems);
  const lattice_of_few best = best_lattice(index);
  random_source random(1);
  std::size_t explain_more = 0;
  for (std::size_t i = 0; i < random_maps && explain_more <= may_explain_more; ++i)
    explain_more +=
        best_lattice(position_index(scattered(stems, displacement * index.spacing(), random))).explains() >=
        best.explains();
  return explain_more <= may_explain_more ? best : lattice_of_few{};
}

}  // namespace globalmatch::detail

// Planting lattice of few stems: so few that the map does not repeat at its shifts often enough to be sure.
// In: a stem map. Out: how near its stems are to the places of the lattice that fits them best. Ours.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
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
  static constexpr std::size_t max_stems = 48;  ///< of more it is not looked for

  /// Stems a place, one at most, in the parallelogram of cells that holds them; 0 where there is no lattice.
  double occupied = 0;
  double sigma = 0;  ///< [m] per coordinate, of stems from their places

  /// The larger, the more stems are near places of a lattice that has few others.
  double explains() const { return occupied > 0 ? occupied / (sigma * sigma) : 0; }

  /// Probability that a stem of an unrelated map on an equal lattice is within `inlier_threshold` [m] of one
  /// that has the same place: both are as far off it.
  double inlier_probability(double inlier_threshold) const {
    const double in_sigmas = inlier_threshold / sigma;
    return occupied > 0 ? -std::expm1(-in_sigmas * in_sigmas / 4) : 0;
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
    constexpr double at_first = 0.6;  // of the stems are near, before most are: three stems are a rough start
    const vec2 a = at(first) - at(origin), b = at(second) - at(origin);
    if (!(std::abs(mat2{{a, b}}.determinant()) > min_sine * a.norm() * b.norm())) return {};
    if (!set(at(origin), {{a, b}}) || !refit(at_first) || !refit(at_first)) return {};
    return about_places();
  }

 private:
  static constexpr double most = 0.8;  // of the stems: some may be on no place

  const vec2& at(std::size_t i) const { return index_.at(stem_index(i)); }

  bool set(const vec2& start, const mat2& cell) {
    constexpr double max_residual = 0.25;  // of the cell's width
    start_ = start;
    cell_ = cell;
    in_cells_ = cell.inverse();
    max_square_ = max_residual * max_residual * std::abs(cell.determinant());
    return max_square_ > 0;
  }

  /// In cells, from the start.
  vec2 place_of(const vec2& stem) const {
    const vec2 in_cells = in_cells_ * (stem - start_);
    return {std::round(in_cells.x), std::round(in_cells.y)};
  }

  /// Least squares over the stems that are near their places, if at least such a share of them is.
  bool refit(double min_share) {
    mat3 normal;
    vec3 right_x, right_y;
    const double max_far = (1 - min_share) * double(index_.size());
    double far = 0;
    for (std::size_t i = 0; i < index_.size(); ++i) {
      const vec2 place = place_of(at(i));
      if ((at(i) - start_ - cell_ * place).squared_norm() > max_square_) {
        if (++far > max_far) return false;
        continue;
      }
      const vec3 row{1, place.x, place.y};
      normal += outer(row, row);
      right_x += at(i).x * row;
      right_y += at(i).y * row;
    }
    if (!normal.is_invertible()) return false;
    const vec3 x = normal.inverse() * right_x, y = normal.inverse() * right_y;
    return set({x.x, y.x}, {{{x.y, y.y}, {x.z, y.z}}});
  }

  lattice_of_few about_places() {
    constexpr double square_of_most = 3.219;  // of two normal coordinates
    constexpr double fitted = 3;              // stems that a lattice always fits
    const double count = double(index_.size());
    squares_.clear();
    vec2 low{}, high{};
    for (std::size_t i = 0; i < index_.size(); ++i) {
      const vec2 place = place_of(at(i));
      squares_.push_back((at(i) - start_ - cell_ * place).squared_norm());
      low = {std::min(low.x, place.x), std::min(low.y, place.y)};
      high = {std::max(high.x, place.x), std::max(high.y, place.y)};
    }
    const double of_most = nth_smallest(squares_, std::size_t(std::ceil(most * count)) - 1);
    if (of_most > max_square_) return {};
    const double places = (high.x - low.x + 1) * (high.y - low.y + 1);
    constexpr double min_sigma = 1e-3;  // [m] no stem is planted better
    return {std::min(1.0, count / places),
            std::max(min_sigma, std::sqrt(of_most / square_of_most * count / (count - fitted)))};
  }

  const position_index& index_;
  vec2 start_;
  mat2 cell_, in_cells_;   // and its inverse
  double max_square_ = 0;  // [m^2] of a stem that is near its place
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

/// Stems as dense, each moved to any place near it so that a lattice is lost and the map is hardly larger.
/// How does not depend on the order of the stems nor on their frame.
class random_neighborhoods {
 public:
  random_neighborhoods(const position_set& stems, const position_index& index) : stems_(stems) {
    constexpr std::size_t around = 3;     // stems of a lattice are next to four
    constexpr double displacement = 0.6;  // of their distance
    std::vector<neighbor<double>> nearest;
    std::vector<double> squares;
    for (std::size_t i = 0; i < stems.size(); ++i) {
      index.nearest(i, around, nearest);
      squares.push_back(nearest.back().squared_distance);
      center_ += stems.at[i] / double(stems.size());
    }
    distance_ = displacement * std::sqrt(median(squares));
    for (std::size_t i = 0; i < stems.size(); ++i)
      from_center_.push_back({key_of((stems.at[i] - center_).xy().squared_norm()), i});
    std::sort(from_center_.begin(), from_center_.end());
  }

  position_set next(random_source& random) const {
    position_set moved;
    for (const keyed& stem : from_center_) {
      const vec3& p = stems_.at[stem.value];
      const double direction =
          std::atan2(p.y - center_.y, p.x - center_.x) + 2 * std::numbers::pi * random.uniform();
      const double far = distance_ * std::sqrt(random.uniform());
      moved.at.push_back(p + vec3{far * std::cos(direction), far * std::sin(direction), 0});
    }
    return moved;
  }

 private:
  const position_set& stems_;
  vec3 center_;
  double distance_ = 0;  // [m]
  std::vector<keyed> from_center_;
};

/// The lattice that few stems are probably planted on: it explains more of them than of nearly all of some
/// maps whose stems are as many, as densely, at random. None (nothing is occupied) where it does not, of
/// fewer stems than four, or of so many that they show it when they are shifted. Cost: quadratic in the
/// stems.
inline lattice_of_few find_lattice_of_few(const position_set& stems) {
  constexpr std::size_t min_stems = 4, random_maps = 19, may_explain_more = 2;
  if (stems.size() < min_stems || stems.size() > lattice_of_few::max_stems) return {};
  const position_index index(stems);
  const lattice_of_few best = best_lattice(index);
  if (best.occupied == 0) return {};
  const random_neighborhoods at_random(stems, index);
  random_source random(1);
  std::size_t explain_more = 0;
  for (std::size_t i = 0; i < random_maps && explain_more <= may_explain_more; ++i)
    explain_more += best_lattice(position_index(at_random.next(random))).explains() >= best.explains();
  return explain_more <= may_explain_more ? best : lattice_of_few{};
}

}  // namespace globalmatch::detail

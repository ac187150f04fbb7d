// Steps that coordinates were noted in: of a length along both axes, or of an angle and a distance from the
// origin, as by compass and tape. In: places. Out: the area of the cells that they lie in.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

#include "globalmatch/detail/core/vectors.hpp"

namespace globalmatch::detail {

/// Whether nine in ten numbers are multiples of a step, to within `tolerance`, but for what they have in
/// common: that of the middle one, or none where `from_zero`.
inline bool are_multiples(std::span<const double> numbers, double step, double tolerance, bool from_zero) {
  constexpr double required = 0.9;
  const double common = from_zero ? 0 : numbers[numbers.size() / 2];
  std::size_t multiples = 0;
  for (const double number : numbers)
    multiples += std::abs(std::remainder(number - common, step)) <= tolerance;
  return double(multiples) >= required * double(numbers.size());
}

/// The widest step [m] that people and programs round lengths to of which numbers [m] are multiples; 0 where
/// there is none.
inline double step_of_lengths(std::span<const double> lengths, double min_tolerance, bool from_zero) {
  constexpr double feet = 0.3048;
  constexpr double steps[] = {5,        2,   1,    0.5,        feet, 0.25,  0.2,   0.1,
                              feet / 4, .05, 0.02, feet / 100, 0.01, 0.005, 0.002, 0.001};
  constexpr double relative_tolerance = 0.01, max_tolerance = 0.1;  // of the step
  for (const double step : steps) {
    if (min_tolerance > max_tolerance * step) return 0;
    if (are_multiples(lengths, step, std::max(min_tolerance, relative_tolerance * step), from_zero))
      return step;
  }
  return 0;
}

/// Area [m^2] of the cells that places in steps lie in, one place in each; 0 where they are not in steps.
/// Fewer than eight places do not show it. Cost: some hundreds of places are looked at.
inline double cell_area(std::span<const vec3> places) {
  constexpr std::size_t minimum = 8, enough = 512;
  if (places.size() < minimum) return 0;
  const std::size_t every = (places.size() + enough - 1) / enough;
  std::vector<double> x, y, distances;
  double largest = 0;
  for (std::size_t i = 0; i < places.size(); i += every) {
    x.push_back(places[i].x);
    y.push_back(places[i].y);
    distances.push_back(places[i].xy().norm());
    largest = std::max(largest, distances.back());
  }
  const double rounding = 1e-12 * largest + 1e-9;  // [m] of the numbers themselves
  const double step = std::min(step_of_lengths(x, rounding, false), step_of_lengths(y, rounding, false));
  const double tolerance = std::max(rounding, 0.75 * step);  // [m] of places that are written in steps
  const double apart = step_of_lengths(distances, tolerance, true);
  if (!(apart > step)) return step * step;
  for (const double degrees : {10.0, 5.0, 2.0, 1.0, 0.5}) {
    const double angle = degrees * std::numbers::pi / 180;
    std::size_t multiples = 0;
    double area = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double off = std::remainder(std::atan2(y[i], x[i]), angle);
      multiples += std::abs(off) * distances[i] <= tolerance + 0.02 * angle * distances[i];
      area += apart * angle * distances[i] / double(x.size());
    }
    if (10 * multiples >= 9 * x.size()) return std::max(area, step * step);
  }
  return step * step;
}

}  // namespace globalmatch::detail

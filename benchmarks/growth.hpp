// How a cost grows with size.
#pragma once

#include <cmath>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

/// Slope of log(y) over log(x).
inline double growth_exponent(const std::vector<std::pair<double, double>>& points) {
  double x = 0, y = 0, xx = 0, xy = 0;
  for (const auto& [of, value] : points) {
    const double u = std::log(of), v = std::log(value);
    x += u, y += v, xx += u * u, xy += u * v;
  }
  const double n = double(points.size());
  return (n * xy - x * y) / (n * xx - x * x);
}

}  // namespace globalmatch::benchmarks

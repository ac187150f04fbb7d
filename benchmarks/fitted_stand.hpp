// Stands of any area with the density and the pair correlation of a measured one: clusters of trees that keep
// apart. In: stems of a stand. Out: what was fitted, and stands like it.
#pragma once

#include "stem_layouts.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

/// Pair correlation of stems: how many more there are at a distance from a stem than anywhere.
struct pair_correlation {
  static constexpr double width = 0.5;  ///< [m] of the bins
  static constexpr std::size_t bins = 120;
  double density = 0;    ///< [1/m^2]
  double at[bins] = {};  ///< of each bin of distances
  static double middle(std::size_t bin) { return width * (double(bin) + 0.5); }
};

/// The rectangle around positions.
struct bounds {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300), high = Eigen::Vector2d::Constant(-1e300);
  explicit bounds(const positions& stems) {
    for (const auto& p : stems) low = low.cwiseMin(p.head<2>()), high = high.cwiseMax(p.head<2>());
  }
  Eigen::Vector2d size() const { return high - low; }
};

/// Of stems on a rectangle, with Ohser's and Stoyan's correction of its edges (translation).
inline pair_correlation correlation_of(positions stems) {
  const Eigen::Vector2d size = bounds(stems).size();
  pair_correlation g;
  g.density = double(stems.size()) / size.prod();
  std::sort(stems.begin(), stems.end(), [](const auto& a, const auto& b) { return a.x() < b.x(); });
  constexpr double range = pair_correlation::width * double(pair_correlation::bins);
  for (std::size_t i = 0; i < stems.size(); ++i)
    for (std::size_t k = i + 1; k < stems.size() && stems[k].x() - stems[i].x() < range; ++k) {
      const Eigen::Vector2d apart = (stems[k] - stems[i]).head<2>().cwiseAbs();
      if (const double distance = apart.norm(); distance < range)
        g.at[std::size_t(distance / pair_correlation::width)] += 2 / (size - apart).prod();
    }
  for (std::size_t b = 0; b < pair_correlation::bins; ++b) {
    const double inner = pair_correlation::width * double(b), outer = inner + pair_correlation::width;
    g.at[b] /= g.density * g.density * std::numbers::pi * (outer * outer - inner * inner);
  }
  return g;
}

/// A Thomas process whose trees keep apart: Gaussian clusters, of which a tree is kept as near ones allow.
/// Fitted are, on the file's pair correlation g, the spread of clusters and their density (least squares over
/// all distances from `apart` on, where the trees of clusters give g(r) = 1 + excess exp(-r^2 / (4
/// spread^2)); Thomas 1949), and below it the probability that a tree is kept at a distance of another: g
/// over that.
struct fitted_stand {
  static constexpr double apart = 4;  ///< [m] at which trees do not keep others away
  static constexpr std::size_t inhibited = std::size_t(apart / pair_correlation::width);
  double density = 0;           ///< [1/m^2]
  double spread = 1;            ///< [m] standard deviation of a cluster's trees, along each axis
  double excess = 0;            ///< of the pair correlation of clusters at 0
  double kept[inhibited] = {};  ///< for each bin of distances

  explicit fitted_stand(const pair_correlation& g) : density(g.density) {
    constexpr double min_spread = 1, max_spread = 100, step = 1;  // [m]
    double least = 1e300;
    for (double s = min_spread; s <= max_spread; s += step) {
      double product = 0, square = 0, residual = 0;
      for (std::size_t b = inhibited; b < pair_correlation::bins; ++b) {
        const double r = pair_correlation::middle(b), e = std::exp(-r * r / (4 * s * s));
        product += r * e * (g.at[b] - 1), square += r * e * e;  // pairs of a bin grow with distance
      }
      const double height = std::max(0.0, product / square);
      for (std::size_t b = inhibited; b < pair_correlation::bins; ++b) {
        const double r = pair_correlation::middle(b), e = std::exp(-r * r / (4 * s * s));
        residual += r * std::pow(g.at[b] - 1 - height * e, 2);
      }
      if (residual < least) least = residual, spread = s, excess = height;
    }
    for (std::size_t b = 0; b < inhibited; ++b)
      kept[b] = std::min(1.0, g.at[b] / of_clusters(pair_correlation::middle(b)));
  }

  /// Pair correlation of clusters whose trees do not keep apart.
  double of_clusters(double distance) const {
    return 1 + excess * std::exp(-distance * distance / (4 * spread * spread));
  }
  /// [1/m^2] of clusters; infinite where there are none.
  double clusters() const { return 1 / (4 * std::numbers::pi * spread * spread * excess); }

  /// Trees on `width` by `depth` [m].
  positions plant(double width, double depth, random_source& random, const relief& ground = {}) const;
};

/// Positions by cells, as they are added.
class growing_cells {
 public:
  growing_cells(double width, double depth, double cell)
      : cell_(cell),
        columns_(std::size_t(width / cell) + 3),
        cells_(columns_ * (std::size_t(depth / cell) + 3)) {}

  void add(const Eigen::Vector2d& p) { cells_[row(p) * columns_ + column(p)].push_back(p); }

  /// Calls `visit(distance)` for those nearer than a cell is wide.
  template <class Visit>
  void for_each_near(const Eigen::Vector2d& p, const Visit& visit) const {
    for (std::size_t r = row(p) - 1; r <= row(p) + 1; ++r)
      for (std::size_t c = column(p) - 1; c <= column(p) + 1; ++c)
        for (const Eigen::Vector2d& q : cells_[r * columns_ + c])
          if (const double distance = (p - q).norm(); distance < cell_) visit(distance);
  }

 private:
  std::size_t row(const Eigen::Vector2d& p) const { return 1 + std::size_t(p.y() / cell_); }
  std::size_t column(const Eigen::Vector2d& p) const { return 1 + std::size_t(p.x() / cell_); }

  double cell_;
  std::size_t columns_;
  std::vector<std::vector<Eigen::Vector2d>> cells_;
};

inline positions fitted_stand::plant(double width, double depth, random_source& random,
                                     const relief& ground) const {
  constexpr double negligible = 0.01;  // excess of clusters that are none
  const bool is_clustered = excess > negligible;
  const double margin = is_clustered ? 4 * spread : 0;
  const auto anywhere = [&] {
    return Eigen::Vector2d(uniform(random, -margin, width + margin),
                           uniform(random, -margin, depth + margin));
  };
  std::vector<Eigen::Vector2d> clusters_at;
  if (is_clustered)
    for (auto i = std::size_t(clusters() * (width + 2 * margin) * (depth + 2 * margin)); i > 0; --i)
      clusters_at.push_back(anywhere());
  growing_cells cells(width, depth, apart);
  const auto count = std::size_t(density * width * depth);
  positions trees;
  while (trees.size() < count) {
    Eigen::Vector2d p = anywhere();
    if (is_clustered)
      p = any_of(clusters_at, random) + spread * Eigen::Vector2d(random.normal(), random.normal());
    if (p.x() < 0 || p.y() < 0 || p.x() >= width || p.y() >= depth) continue;
    double probability = 1;
    cells.for_each_near(p, [&](double d) {
      probability *= kept[std::min(inhibited - 1, std::size_t(d / pair_correlation::width))];
    });
    if (random.uniform() >= probability) continue;
    cells.add(p);
    trees.push_back({p.x(), p.y(), ground(p.x(), p.y())});
  }
  return trees;
}

}  // namespace globalmatch::benchmarks

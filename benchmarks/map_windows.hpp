// Windows of stem maps, as a survey sees them.
#pragma once

#include "stem_layouts.hpp"
#include "support/stem_files.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

inline std::vector<positions> read_maps(const std::vector<std::filesystem::path>& files) {
  std::vector<positions> maps;
  for (const auto& file : files) {
    maps.emplace_back();
    for (const auto& s : support::read_stems(file).stems) maps.back().push_back({s.x, s.y, s.z});
  }
  return maps;
}

/// Trees of a map around a place, nearest first, and how far the last one is.
struct window {
  std::vector<std::size_t> trees;
  Eigen::Vector3d center;
  double radius = 0;  // [m]
};

inline window cut_window(const positions& map, const Eigen::Vector3d& center, std::size_t trees) {
  window w{{}, center, 0};
  std::vector<std::pair<double, std::size_t>> by_distance;
  for (std::size_t i = 0; i < map.size(); ++i) by_distance.push_back({(map[i] - center).head<2>().norm(), i});
  std::partial_sort(by_distance.begin(), by_distance.begin() + std::ptrdiff_t(trees), by_distance.end());
  for (std::size_t k = 0; k < trees; ++k) w.trees.push_back(by_distance[k].second);
  w.radius = trees > 0 ? by_distance[trees - 1].first : 0;
  return w;
}

/// What a survey makes of a window: stems dropped, displaced by noise, and false ones added at any place in
/// it. `seen` receives the trees that are left.
inline positions survey(const positions& map, const window& w, const view_options& view,
                        random_source& random, std::set<std::size_t>& seen) {
  positions stems;
  for (const std::size_t i : w.trees)
    if (random.uniform() < view.detected) {
      stems.push_back(map[i] + gaussian(random, view.noise));
      seen.insert(i);
    }
  for (auto i = std::size_t(view.false_stems * double(stems.size())); i > 0; --i) {
    const double direction = uniform(random, 0, 2 * std::numbers::pi);
    const double distance = w.radius * std::sqrt(random.uniform());
    stems.push_back(w.center +
                    Eigen::Vector3d(distance * std::cos(direction), distance * std::sin(direction), 0));
  }
  return stems;
}

}  // namespace globalmatch::benchmarks

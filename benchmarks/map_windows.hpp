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
#include <string>
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

/// A large map, or all others.
struct map_group {
  std::string name;
  std::vector<positions> maps;

  /// Trees of the largest one.
  std::size_t max_trees() const {
    std::size_t trees = 0;
    for (const positions& map : maps) trees = std::max(trees, map.size());
    return trees;
  }
};

inline std::vector<map_group> read_groups(const std::vector<std::filesystem::path>& files) {
  constexpr std::size_t large = 1000;
  std::vector<map_group> groups;
  map_group others{"others", {}};
  for (const auto& file : files) {
    std::vector<positions> map = read_maps({file});
    if (map[0].size() < large)
      others.maps.push_back(std::move(map[0]));
    else
      groups.push_back({file.stem().string(), std::move(map)});
  }
  if (!others.maps.empty()) groups.push_back(std::move(others));
  return groups;
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

/// Two windows of a map, and how many stems are in both.
struct window_pair {
  two_maps maps;
  std::size_t common = 0;  // stems in both
};

/// How far the centers of two windows are apart, in radii: circles at 0.8 share half of their area.
struct center_distance {
  double min = 0.8, max = 1.7;
};

/// Two windows that overlap. None shows more than half of the map, or the other could not but show the same.
inline window_pair cut_pair(const positions& map, std::size_t trees, const view_options& view,
                            random_source& random, const center_distance& apart = {}) {
  trees = std::min(trees, map.size() / 2);
  const Eigen::Vector3d& place = map[random.below(static_cast<std::uint32_t>(map.size()))];
  const window first = cut_window(map, place, trees);
  const double direction = uniform(random, 0, 2 * std::numbers::pi);
  const double distance = first.radius * uniform(random, apart.min, apart.max);
  const window second =
      cut_window(map, place + distance * Eigen::Vector3d(std::cos(direction), std::sin(direction), 0), trees);
  window_pair pair;
  std::set<std::size_t> in_first, in_second;
  pair.maps.source = survey(map, first, view, random, in_first);
  pair.maps.target = survey(map, second, view, random, in_second);
  pair.maps.target_from_source =
      Eigen::Translation3d(uniform(random, -100, 100), uniform(random, -100, 100), 5) *
      Eigen::AngleAxisd(uniform(random, -std::numbers::pi, std::numbers::pi), Eigen::Vector3d::UnitZ());
  for (Eigen::Vector3d& p : pair.maps.target) p = pair.maps.target_from_source * p;
  for (const std::size_t i : in_first) pair.common += in_second.count(i);
  return pair;
}

/// Whether the stems end, on average, less than 0.3 m, or three standard deviations of the noise, from their
/// true places.
inline bool is_right(const Eigen::Isometry3d& transform, const two_maps& maps, double noise) {
  return mean_error(transform, maps.target_from_source, maps.source) < std::max(0.3, 3 * noise);
}

/// Two maps with nothing in common.
struct unrelated {
  positions source, target;
};

inline void move_elsewhere(positions& stems, random_source& random) {
  const Eigen::Isometry3d by = any_yaw_elsewhere(random);
  for (Eigen::Vector3d& p : stems) p = by * p;
}

/// Makes pairs of windows of real maps.
class window_source {
 public:
  window_source(const std::vector<positions>& maps, std::size_t max_stems)
      : maps_(maps), max_stems_(max_stems) {}

  /// Of trees of one map or two, none of them in both.
  unrelated pair(random_source& random) const {
    unrelated result;
    while (true) {
      const positions &a = any_map(random), &b = any_map(random);
      const window of_source = any_window(a, random), of_target = any_window(b, random);
      if (&a == &b &&
          (of_source.center - of_target.center).head<2>().norm() < of_source.radius + of_target.radius)
        continue;
      const double noise = any_of<double>({0.02, 0.05, 0.1}, random);
      result.source = seen(a, of_source, noise, random);
      result.target = seen(b, of_target, noise, random);
      move_elsewhere(result.target, random);
      return result;
    }
  }

  /// Windows of one map that overlap, with so much noise [m].
  window_pair overlapping(double noise, random_source& random) const {
    const positions& map = any_map(random);
    return cut_pair(map, any_count(map, random), {.noise = noise}, random);
  }

  /// One window, seen twice.
  unrelated same(random_source& random) const {
    const positions& map = any_map(random);
    const window shown = any_window(map, random);
    const double noise = any_of<double>({0.02, 0.05, 0.1}, random);
    return {seen(map, shown, noise, random), seen(map, shown, noise, random)};
  }

 private:
  /// That of any tree.
  const positions& any_map(random_source& random) const {
    std::size_t trees = 0;
    for (const positions& map : maps_) trees += map.size();
    std::size_t tree = random.below(static_cast<std::uint32_t>(trees));
    for (const positions& map : maps_) {
      if (tree < map.size()) return map;
      tree -= map.size();
    }
    return maps_.back();
  }

  /// Trees of a window: as many windows in each octave.
  std::size_t any_count(const positions& map, random_source& random) const {
    constexpr double minimum = 15;
    const double maximum = std::max(minimum, double(std::min(max_stems_, map.size() / 3)));
    const auto trees = std::size_t(std::round(minimum * std::pow(maximum / minimum, random.uniform())));
    return std::min(trees, map.size());
  }

  window any_window(const positions& map, random_source& random) const {
    const std::size_t trees = any_count(map, random);
    return cut_window(map, any_of(map, random), trees);
  }

  static positions seen(const positions& map, const window& w, double noise, random_source& random) {
    std::set<std::size_t> trees;
    positions stems = survey(map, w, {.noise = noise}, random, trees);
    for (Eigen::Vector3d& p : stems) p -= w.center;
    return stems;
  }

  const std::vector<positions>& maps_;
  std::size_t max_stems_;
};

}  // namespace globalmatch::benchmarks

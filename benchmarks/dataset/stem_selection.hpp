// Stem maps of two scans for matching alone, whole or simplified.
#pragma once

#include <globalmatch/evaluation.hpp>

#include "evaluated_scans.hpp"
#include "stem_layouts.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace globalmatch::benchmarks {

/// Stems of both maps that stand at one place by the true transform.
inline std::vector<true_find> common_stems(const evaluated_scan& source, const evaluated_scan& target,
                                           const Eigen::Isometry3d& target_from_source) {
  // Paired horizontally in the frame of the plot, whose z is up.
  const Eigen::Isometry3d plot_from_source = target.plot_from_scan * target_from_source;
  std::vector<Eigen::Vector3d> placed;
  for (const stem& s : source.map.stems) placed.push_back(plot_from_source * s.position);
  return pair_finds(placed, stems_in_plot(target), same_stem);
}

/// Stems of a map with true stems of the plot that they are, by index; those seen in the scan only.
inline std::vector<std::size_t> found_stems(const evaluated_scan& scan, const true_stems& truth) {
  std::vector<Eigen::Vector3d> places;
  const std::vector<std::size_t> seen = seen_stems(truth);
  for (const std::size_t s : seen) places.push_back(truth.positions[s]);
  std::vector<std::size_t> found;
  for (const true_find& pair : pair_finds(stems_in_plot(scan), places, same_stem))
    found.push_back(seen[pair.stem]);
  std::sort(found.begin(), found.end());
  return found;
}

/// Which stems of a map: as many as `count`, and those within `range` [m] of the scanner, horizontally; 0:
/// all.
struct stem_selection {
  std::size_t count = 0;
  double range = 0;

  bool is_whole() const { return count == 0 && range == 0; }
  bool has(const stem& s) const { return range == 0 || s.position.head<2>().norm() <= range; }
};

/// `count` stems of each map, as [GM] 5.3 prepares them for methods that bear no more: all that are common
/// first, those nearest to the middle between both scanners first; then those nearest to the own scanner.
inline two_maps select_stems(const evaluated_scan& source, const evaluated_scan& target,
                             const Eigen::Isometry3d& target_from_source, const stem_selection& selection) {
  std::vector<true_find> pairs = common_stems(source, target, target_from_source);
  const std::size_t count = selection.count;
  std::erase_if(pairs, [&](const true_find& pair) {
    return !selection.has(source.map.stems[pair.find]) || !selection.has(target.map.stems[pair.stem]);
  });
  const Eigen::Vector3d middle = 0.5 * target_from_source.translation();  // frame of the target
  std::stable_sort(pairs.begin(), pairs.end(), [&](const true_find& a, const true_find& b) {
    const auto& stems = target.map.stems;
    return (stems[a.stem].position - middle).norm() < (stems[b.stem].position - middle).norm();
  });
  const auto selected = [&](const stem_map& map, const auto& index_of) {
    std::vector<std::size_t> order;
    std::vector<bool> taken(map.stems.size());
    for (const true_find& pair : pairs) {
      order.push_back(index_of(pair));
      taken[order.back()] = true;
    }
    const auto behind = std::ptrdiff_t(order.size());
    for (std::size_t i = 0; i < map.stems.size(); ++i)
      if (!taken[i] && selection.has(map.stems[i])) order.push_back(i);
    std::stable_sort(order.begin() + behind, order.end(), [&](std::size_t a, std::size_t b) {
      return map.stems[a].position.norm() < map.stems[b].position.norm();
    });
    if (count > 0 && order.size() > count) order.resize(count);
    return order;
  };
  two_maps maps;
  maps.target_from_source = target_from_source;
  for (const std::size_t i : selected(source.map, [](const true_find& p) { return p.find; })) {
    maps.source.push_back(source.map.stems[i].position);
    maps.source_radii.push_back(source.map.stems[i].radius);
  }
  for (const std::size_t i : selected(target.map, [](const true_find& p) { return p.stem; })) {
    maps.target.push_back(target.map.stems[i].position);
    maps.target_radii.push_back(target.map.stems[i].radius);
  }
  maps.common = count > 0 ? std::min(count, pairs.size()) : pairs.size();
  return maps;
}

}  // namespace globalmatch::benchmarks

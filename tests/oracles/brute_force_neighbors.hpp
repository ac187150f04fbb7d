// Nearest neighbours by looking at every point: the oracle of `neighbor_tree`.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "globalmatch/detail/core/neighbors.hpp"

namespace globalmatch::oracles {

using namespace detail;

template <class T, std::size_t Dimension>
std::vector<neighbor<T>> all_by_distance(const std::vector<std::array<T, Dimension>>& points,
                                         const std::array<T, Dimension>& query) {
  std::vector<neighbor<T>> all;
  for (std::size_t i = 0; i < points.size(); ++i) {
    T squared_distance = 0;
    for (std::size_t d = 0; d < Dimension; ++d) {
      const T difference = query[d] - points[i][d];
      squared_distance += difference * difference;
    }
    all.push_back({static_cast<std::uint32_t>(i), squared_distance});
  }
  std::sort(all.begin(), all.end());
  return all;
}

template <class T, std::size_t Dimension>
std::vector<neighbor<T>> brute_force_nearest(const std::vector<std::array<T, Dimension>>& points,
                                             const std::array<T, Dimension>& query, std::size_t k) {
  std::vector<neighbor<T>> all = all_by_distance(points, query);
  all.resize(std::min(all.size(), k));
  return all;
}

template <class T, std::size_t Dimension>
std::vector<neighbor<T>> brute_force_within(const std::vector<std::array<T, Dimension>>& points,
                                            const std::array<T, Dimension>& query, T radius) {
  std::vector<neighbor<T>> all = all_by_distance(points, query);
  std::erase_if(all, [&](const neighbor<T>& n) { return !(n.squared_distance < radius * radius); });
  return all;
}

}  // namespace globalmatch::oracles

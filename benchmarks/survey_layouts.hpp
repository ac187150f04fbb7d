// Simulated surveys: a stand seen from many stations, as far as trees do not hide each other.
#pragma once

#include "stem_layouts.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

/// How a stand is surveyed.
struct survey_layout {
  double spacing = 22;        ///< [m] of the stations, on a grid
  double offset = 3;          ///< [m] by which each is off it, in x and in y, at most
  double max_range = 40;      ///< [m] at which trees are seen
  double half_range = 25;     ///< [m] at which half of those not hidden are detected
  double noise = 0.035;       ///< [m] standard deviation of each coordinate of a stem
  double false_stems = 0.05;  ///< added, as a share of those seen
  double radius = 0.12;       ///< [m] of the trees, that hide others
};

/// A map of a survey, in the frame of its scan.
struct surveyed_map {
  positions stems;
  std::vector<std::size_t> trees;  ///< of each stem; `no_tree` for false ones
  Eigen::Isometry3d stand_from_scan = Eigen::Isometry3d::Identity();
  int stand = 0;  ///< maps of different stands have nothing in common
};
constexpr std::size_t no_tree = std::size_t(-1);

/// Trees by cells, so that large stands are surveyed in linear time.
class tree_cells {
 public:
  tree_cells(const positions& trees, double width) : trees_(trees), width_(width) {
    for (const auto& t : trees) {
      low_ = low_.cwiseMin(t.head<2>());
      high_ = high_.cwiseMax(t.head<2>());
    }
    columns_ = index(high_.x(), low_.x()) + 1;
    cells_.resize(columns_ * (index(high_.y(), low_.y()) + 1));
    for (std::size_t i = 0; i < trees.size(); ++i)
      cells_[index(trees[i].y(), low_.y()) * columns_ + index(trees[i].x(), low_.x())].push_back(i);
  }

  const Eigen::Vector2d& low() const { return low_; }
  const Eigen::Vector2d& high() const { return high_; }

  std::vector<std::size_t> within(const Eigen::Vector2d& place, double range) const {
    std::vector<std::size_t> found;
    const std::size_t rows = cells_.size() / columns_;
    for (std::size_t r = index(place.y() - range, low_.y());
         r <= std::min(rows - 1, index(place.y() + range, low_.y())); ++r)
      for (std::size_t c = index(place.x() - range, low_.x());
           c <= std::min(columns_ - 1, index(place.x() + range, low_.x())); ++c)
        for (const std::size_t i : cells_[r * columns_ + c])
          if ((trees_[i].head<2>() - place).norm() < range) found.push_back(i);
    return found;
  }

 private:
  std::size_t index(double v, double from) const {
    return std::size_t(std::max(0.0, std::floor((v - from) / width_)));
  }

  const positions& trees_;
  double width_;
  Eigen::Vector2d low_ = Eigen::Vector2d::Constant(1e300), high_ = Eigen::Vector2d::Constant(-1e300);
  std::size_t columns_ = 0;
  std::vector<std::vector<std::size_t>> cells_;
};

/// Whether nearer trees, which are marked in `hidden` by directions, leave the middle of one to be seen;
/// marks it in turn. Trees come nearest first.
inline bool is_seen(const Eigen::Vector2d& to_tree, double radius, std::vector<bool>& hidden) {
  const double turn = 2 * std::numbers::pi, width = turn / double(hidden.size());
  const double direction = std::atan2(to_tree.y(), to_tree.x()) + turn;
  const double half = std::asin(std::min(1.0, radius / to_tree.norm()));
  const auto at = [&](double angle) { return std::size_t(angle / width) % hidden.size(); };
  const bool seen = !hidden[at(direction)];
  for (double angle = direction - half; angle <= direction + half; angle += width) hidden[at(angle)] = true;
  return seen;
}

/// What a station sees; the frame of its scan has any yaw.
inline surveyed_map survey_from(const positions& trees, const tree_cells& cells,
                                const Eigen::Vector2d& station, const survey_layout& layout,
                                random_source& random) {
  constexpr std::size_t directions = 7200;
  surveyed_map map;
  map.stand_from_scan.linear() =
      Eigen::AngleAxisd(uniform(random, 0, 2 * std::numbers::pi), Eigen::Vector3d::UnitZ())
          .toRotationMatrix();
  std::vector<std::pair<double, std::size_t>> by_distance;
  for (const std::size_t i : cells.within(station, layout.max_range))
    by_distance.emplace_back((trees[i].head<2>() - station).norm(), i);
  std::sort(by_distance.begin(), by_distance.end());
  const double ground = by_distance.empty() ? 0 : trees[by_distance.front().second].z();
  map.stand_from_scan.translation() << station, ground + 1.5;
  const Eigen::Isometry3d scan_from_stand = map.stand_from_scan.inverse();
  std::vector<bool> hidden(directions, false);
  for (const auto& [distance, i] : by_distance) {
    const bool seen = is_seen(trees[i].head<2>() - station, layout.radius, hidden);
    const double detected = 1 / (1 + std::pow(distance / layout.half_range, 4));
    if (!seen || random.uniform() > detected) continue;
    map.stems.push_back(scan_from_stand * trees[i] + gaussian(random, layout.noise));
    map.trees.push_back(i);
  }
  const auto added = std::size_t(layout.false_stems * double(map.stems.size()));
  for (std::size_t i = 0; i < added; ++i) {
    const double range = layout.half_range * std::sqrt(random.uniform()),
                 direction = uniform(random, 0, 2 * std::numbers::pi);
    map.stems.push_back({range * std::cos(direction), range * std::sin(direction), -1.5 + random.normal()});
    map.trees.push_back(no_tree);
  }
  return map;
}

/// A stand from stations all over it, at most `maximum` of them, row by row.
inline std::vector<surveyed_map> survey_stand(const positions& trees, const survey_layout& layout,
                                              std::size_t maximum, random_source& random, int stand = 0) {
  const tree_cells cells(trees, layout.max_range);
  std::vector<surveyed_map> maps;
  for (double y = cells.low().y() + layout.spacing / 2; y < cells.high().y(); y += layout.spacing)
    for (double x = cells.low().x() + layout.spacing / 2; x < cells.high().x() && maps.size() < maximum;
         x += layout.spacing) {
      const Eigen::Vector2d station(x + uniform(random, -layout.offset, layout.offset),
                                    y + uniform(random, -layout.offset, layout.offset));
      maps.push_back(survey_from(trees, cells, station, layout, random));
      maps.back().stand = stand;
    }
  return maps;
}

}  // namespace globalmatch::benchmarks

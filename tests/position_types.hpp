// The types that callers keep their stem positions in.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace globalmatch::scenes {

struct tree {
  double x, y, z;
  std::string species;
};

/// A horizontal position.
struct map_symbol {
  int number;
  double x, y;
};

/// Calls `check(name, range)` for the positions in several containers that hold heights.
template <class Check>
void for_each_type_with_heights(const std::vector<Eigen::Vector3d>& stems, const Check& check) {
  std::vector<tree> trees;
  std::vector<std::array<double, 3>> arrays;
  Eigen::Matrix3Xd columns(3, static_cast<Eigen::Index>(stems.size()));
  for (const Eigen::Vector3d& p : stems) {
    trees.push_back({p.x(), p.y(), p.z(), "beech"});
    arrays.push_back({p.x(), p.y(), p.z()});
    columns.col(static_cast<Eigen::Index>(arrays.size()) - 1) = p;
  }
  check("Eigen::Vector3d", stems);
  check("struct with x, y and z", trees);
  check("std::array of three", arrays);
  check("columns of a matrix", columns.colwise());
}

/// Calls `check(name, range)` for the positions in several containers that hold none.
template <class Check>
void for_each_type_without_heights(const std::vector<Eigen::Vector3d>& stems, const Check& check) {
  std::vector<map_symbol> symbols;
  std::vector<std::array<double, 2>> arrays;
  std::vector<Eigen::Vector2d> vectors;
  Eigen::Matrix2Xd columns(2, static_cast<Eigen::Index>(stems.size()));
  for (const Eigen::Vector3d& p : stems) {
    symbols.push_back({7, p.x(), p.y()});
    arrays.push_back({p.x(), p.y()});
    vectors.push_back(p.head<2>());
    columns.col(static_cast<Eigen::Index>(vectors.size()) - 1) = p.head<2>();
  }
  check("struct with x and y", symbols);
  check("std::array of two", arrays);
  check("Eigen::Vector2d", vectors);
  check("columns of a matrix of two rows", columns.colwise());
}

}  // namespace globalmatch::scenes

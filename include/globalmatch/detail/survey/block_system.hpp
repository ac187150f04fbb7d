// Sparse symmetric systems of equal blocks, whose pattern is known beforehand: the normal equations of poses.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/detail/survey/block_cholesky.hpp"

namespace globalmatch::detail {

/// `size` unknown blocks of `Dimension` numbers; the pattern of the matrix is given by pairs of blocks.
template <int Dimension>
class block_system {
 public:
  using block = Eigen::Matrix<double, Dimension, Dimension>;
  using vector = Eigen::Matrix<double, Dimension, 1>;

  /// `pairs` of different blocks that have something in common, in any order, also more than once. Throws
  /// `std::length_error` where the matrix has 2^31 numbers or more.
  block_system(std::size_t size, std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs)
      : size_(size), first_(size + 1, 0) {
    for (auto& [row, column] : pairs)
      if (row < column) std::swap(row, column);
    for (std::uint32_t i = 0; i < size; ++i) pairs.emplace_back(i, i);
    std::sort(pairs.begin(), pairs.end(), [](const auto& a, const auto& b) {
      return a.second != b.second ? a.second < b.second : a.first < b.first;
    });
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    rows_.reserve(pairs.size());
    for (const auto& [row, column] : pairs) rows_.push_back(row), ++first_[column + 1];
    for (std::size_t c = 0; c < size; ++c) first_[c + 1] += first_[c];
    if (rows_.size() >= std::size_t(std::numeric_limits<int>::max()) / (Dimension * Dimension))
      throw std::length_error("the maps of a survey have too many pairs that share trees");
    blocks_.resize(rows_.size());
    factors_ = block_cholesky<Dimension>(first_, rows_);
    set_zero();
  }

  void set_zero() {
    std::fill(blocks_.begin(), blocks_.end(), block::Zero());
    right_ = Eigen::VectorXd::Zero(Eigen::Index(size_) * Dimension);
  }

  /// Adds to the block of `row` and `column`, which are in the pattern; where they differ its transpose is
  /// added to the other one.
  void add(std::size_t row, std::size_t column, const block& summand) {
    if (row >= column)
      blocks_[slot(row, column)] += summand;
    else
      blocks_[slot(column, row)] += summand.transpose();
  }
  void add_right(std::size_t row, const vector& summand) {
    right_.template segment<Dimension>(Eigen::Index(row) * Dimension) += summand;
  }

  /// Factorizes; false where the matrix is not positive definite.
  bool factorize() { return factors_.factorize(blocks_); }

  /// After `factorize`.
  Eigen::VectorXd solve() const { return factors_.solve(right_); }

  /// The blocks of the inverse matrix on the diagonal, after `factorize`. Cost: that of two factorizations.
  std::vector<block> inverse_blocks() const { return factors_.inverse_blocks(); }

 private:
  std::size_t slot(std::size_t row, std::size_t column) const {
    const auto begin = rows_.begin() + std::ptrdiff_t(first_[column]),
               end = rows_.begin() + std::ptrdiff_t(first_[column + 1]);
    return std::size_t(std::lower_bound(begin, end, row) - rows_.begin());
  }

  std::size_t size_;
  std::vector<std::size_t> first_;   // of each column of blocks
  std::vector<std::uint32_t> rows_;  // of each block, increasing in a column
  std::vector<block> blocks_;        // below the diagonal and on it
  Eigen::VectorXd right_;
  block_cholesky<Dimension> factors_;
};

}  // namespace globalmatch::detail

// Sparse symmetric systems of equal blocks, whose pattern is known beforehand: the normal equations of poses.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

namespace globalmatch::detail {

/// What is added on the diagonal beside observations of weight 1, so that a pose without observations leaves
/// the others determined: a thousand standard deviations of one observation.
inline constexpr double damping = 1e-6;

/// `size` unknown blocks of `Dimension` numbers; the pattern of the matrix is given by pairs of blocks.
template <int Dimension>
class block_system {
 public:
  using block = Eigen::Matrix<double, Dimension, Dimension>;
  using vector = Eigen::Matrix<double, Dimension, 1>;

  /// `pairs` of different blocks that have something in common, in any order, also more than once.
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
    blocks_.resize(rows_.size());
    lay_out();
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

  /// Adds `summand` on the diagonal: what nothing else determines stays where it is.
  void add_on_diagonal(double summand) {
    for (std::size_t c = 0; c < size_; ++c) blocks_[first_[c]].diagonal().array() += summand;
  }

  /// Factorizes; false where the matrix is not positive definite.
  bool factorize() {
    double* out = matrix_.valuePtr();
    for (std::size_t c = 0; c < size_; ++c)
      for (int k = 0; k < Dimension; ++k)
        for (std::size_t s = first_[c]; s < first_[c + 1]; ++s)
          for (int r = rows_[s] == c ? k : 0; r < Dimension; ++r) *out++ = blocks_[s](r, k);
    solver_.factorize(matrix_);
    return solver_.info() == Eigen::Success && (solver_.vectorD().array() > 0).all();
  }

  /// After `factorize`.
  Eigen::VectorXd solve() const { return solver_.solve(right_); }

  /// The blocks of the inverse matrix on the diagonal, after `factorize`: from the factors, as far as their
  /// pattern goes (Takahashi, Fagan and Chin 1973, Formation of a sparse bus impedance matrix, PICA). Cost:
  /// that of a factorization.
  std::vector<block> inverse_blocks() const {
    const Eigen::SparseMatrix<double>& lower = solver_.matrixL().nestedExpression();
    const Eigen::VectorXd diagonal = solver_.vectorD();
    const int* first = lower.outerIndexPtr();
    const int* rows = lower.innerIndexPtr();
    std::vector<double> inverse(std::size_t(lower.nonZeros())), on_diagonal(std::size_t(lower.cols()));
    const auto at = [&](int row, int column) -> double {  // of the inverse, in the pattern
      if (row == column) return on_diagonal[std::size_t(row)];
      const int low = std::min(row, column), high = std::max(row, column);
      return inverse[std::size_t(std::lower_bound(rows + first[low], rows + first[low + 1], high) - rows)];
    };
    std::vector<double> sums;
    for (int j = int(lower.cols()); j-- > 0;) {
      const int begin = first[j], count = first[j + 1] - begin;
      sums.assign(std::size_t(count), 0);
      for (int a = 0; a < count; ++a) {
        const int row = rows[begin + a];
        sums[std::size_t(a)] += on_diagonal[std::size_t(row)] * lower.valuePtr()[begin + a];
        int entry = first[row];
        for (int b = a + 1; b < count; ++b) {  // both in the pattern of column `row`
          while (rows[entry] < rows[begin + b]) ++entry;
          const double shared = inverse[std::size_t(entry)];
          sums[std::size_t(a)] += shared * lower.valuePtr()[begin + b];
          sums[std::size_t(b)] += shared * lower.valuePtr()[begin + a];
        }
      }
      double own = 1 / diagonal[j];
      for (int a = 0; a < count; ++a) {
        inverse[std::size_t(begin + a)] = -sums[std::size_t(a)];
        own += sums[std::size_t(a)] * lower.valuePtr()[begin + a];
      }
      on_diagonal[std::size_t(j)] = own;
    }
    const auto& permuted = solver_.permutationP().indices();
    std::vector<block> blocks(size_);
    for (std::size_t i = 0; i < size_; ++i)
      for (int c = 0; c < Dimension; ++c)
        for (int r = 0; r < Dimension; ++r)
          blocks[i](r, c) =
              at(permuted[Eigen::Index(i) * Dimension + r], permuted[Eigen::Index(i) * Dimension + c]);
    return blocks;
  }

 private:
  std::size_t slot(std::size_t row, std::size_t column) const {
    const auto begin = rows_.begin() + std::ptrdiff_t(first_[column]),
               end = rows_.begin() + std::ptrdiff_t(first_[column + 1]);
    return std::size_t(std::lower_bound(begin, end, row) - rows_.begin());
  }

  /// The pattern of the numbers, below the diagonal and on it.
  void lay_out() {
    std::vector<Eigen::Triplet<double>> numbers;
    for (std::size_t c = 0; c < size_; ++c)
      for (std::size_t s = first_[c]; s < first_[c + 1]; ++s)
        for (int k = 0; k < Dimension; ++k)
          for (int r = rows_[s] == c ? k : 0; r < Dimension; ++r)
            numbers.emplace_back(int(rows_[s]) * Dimension + r, int(c) * Dimension + k, 1.0);
    const auto scalars = Eigen::Index(size_) * Dimension;
    matrix_.resize(scalars, scalars);
    matrix_.setFromTriplets(numbers.begin(), numbers.end());
    matrix_.makeCompressed();
    solver_.analyzePattern(matrix_);
  }

  std::size_t size_;
  std::vector<std::size_t> first_;   // of each column of blocks
  std::vector<std::uint32_t> rows_;  // of each block, increasing in a column
  std::vector<block> blocks_;        // below the diagonal and on it
  Eigen::VectorXd right_;
  Eigen::SparseMatrix<double> matrix_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver_;
};

}  // namespace globalmatch::detail

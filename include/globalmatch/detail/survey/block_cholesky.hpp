// Sparse Cholesky factors of a symmetric matrix of small blocks. In: pattern and blocks. Out: solutions, and
// the blocks of the inverse matrix on the diagonal. Blocks share what is looked up in the pattern, which
// takes most of the time of a factorization number by number.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace globalmatch::detail {

/// `L D L^T` of a matrix whose rows and columns are in an order that keeps `L` sparse; left-looking (George
/// and Liu 1981, Computer solution of large sparse positive definite systems).
template <int Dimension>
class block_cholesky {
 public:
  using block = Eigen::Matrix<double, Dimension, Dimension>;

  block_cholesky() = default;
  /// The pattern below the diagonal and on it: the rows of each column begin at `first`, increasing, the one
  /// on the diagonal first.
  block_cholesky(std::span<const std::size_t> first, std::span<const std::uint32_t> rows)
      : size_(first.size() - 1) {
    order(first, rows);
    permute(first, rows);
    find_pattern();
  }

  /// `blocks`: in the order of the pattern. False where the matrix is not positive definite.
  bool factorize(std::span<const block> blocks) {
    constexpr std::uint32_t none = ~std::uint32_t(0);
    std::vector<block> column(size_);
    // Columns whose next row is this one, in lists; and where that row is.
    std::vector<std::uint32_t> head(size_, none), next(size_, none);
    std::vector<std::size_t> at(size_);
    const auto wait_for_row = [&](std::uint32_t k) {
      if (at[k] == first_[k + 1]) return;
      next[k] = head[rows_[at[k]]];
      head[rows_[at[k]]] = k;
    };
    for (std::uint32_t j = 0; j < size_; ++j) {
      column[j].setZero();
      for (std::size_t s = first_[j]; s < first_[j + 1]; ++s) column[rows_[s]].setZero();
      for (std::size_t e = first_entry_[j]; e < first_entry_[j + 1]; ++e) {
        const entry& given = entries_[e];
        if (given.transposed)
          column[given.row] += blocks[given.slot].transpose();
        else
          column[given.row] += blocks[given.slot];
      }
      for (std::uint32_t k = head[j], following; k != none; k = following) {
        following = next[k];
        const block factor = diagonal_[k] * lower_[at[k]].transpose();
        column[j].noalias() -= lower_[at[k]] * factor;
        for (std::size_t s = ++at[k]; s < first_[k + 1]; ++s)
          column[rows_[s]].noalias() -= lower_[s] * factor;
        wait_for_row(k);
      }
      const Eigen::LLT<block> root(column[j]);
      if (root.info() != Eigen::Success || !(root.matrixLLT().diagonal().array() > 0).all()) return false;
      diagonal_[j] = column[j];
      inverse_diagonal_[j] = root.solve(block::Identity());
      for (std::size_t s = first_[j]; s < first_[j + 1]; ++s)
        lower_[s].noalias() = column[rows_[s]] * inverse_diagonal_[j];
      at[j] = first_[j];
      wait_for_row(j);
    }
    return true;
  }

  /// After `factorize`.
  Eigen::VectorXd solve(const Eigen::VectorXd& right) const {
    const auto part = [](auto& v, std::size_t i) {
      return v.template segment<Dimension>(Eigen::Index(i) * Dimension);
    };
    Eigen::VectorXd x(right.size()), solution(right.size());
    for (std::size_t i = 0; i < size_; ++i) part(x, place_[i]) = part(right, i);
    for (std::size_t j = 0; j < size_; ++j)
      for (std::size_t s = first_[j]; s < first_[j + 1]; ++s)
        part(x, rows_[s]).noalias() -= lower_[s] * part(x, j);
    for (std::size_t j = size_; j-- > 0;) {
      part(x, j) = (inverse_diagonal_[j] * part(x, j)).eval();
      for (std::size_t s = first_[j]; s < first_[j + 1]; ++s)
        part(x, j).noalias() -= lower_[s].transpose() * part(x, rows_[s]);
    }
    for (std::size_t i = 0; i < size_; ++i) part(solution, i) = part(x, place_[i]);
    return solution;
  }

  /// The blocks of the inverse matrix on the diagonal, after `factorize`: from the factors, as far as their
  /// pattern goes (Takahashi, Fagan and Chin 1973, Formation of a sparse bus impedance matrix, PICA). Cost:
  /// that of two factorizations.
  std::vector<block> inverse_blocks() const {
    std::vector<block> inverse(lower_.size()), on_diagonal(size_), sums;
    for (std::size_t j = size_; j-- > 0;) {
      const std::size_t begin = first_[j], count = first_[j + 1] - begin;
      sums.assign(count, block::Zero());
      for (std::size_t a = 0; a < count; ++a) {
        const std::uint32_t row = rows_[begin + a];
        const block& own = lower_[begin + a];
        sums[a].noalias() += on_diagonal[row] * own;
        std::size_t s = first_[row];
        for (std::size_t b = a + 1; b < count; ++b) {  // both in the pattern of column `row`
          while (rows_[s] < rows_[begin + b]) ++s;
          sums[a].noalias() += inverse[s].transpose() * lower_[begin + b];
          sums[b].noalias() += inverse[s] * own;
        }
      }
      on_diagonal[j] = inverse_diagonal_[j];
      for (std::size_t a = 0; a < count; ++a) {
        inverse[begin + a] = -sums[a];
        on_diagonal[j].noalias() += lower_[begin + a].transpose() * sums[a];
      }
    }
    std::vector<block> blocks(size_);
    for (std::size_t i = 0; i < size_; ++i) blocks[i] = on_diagonal[place_[i]];
    return blocks;
  }

 private:
  /// A given block in the permuted matrix.
  struct entry {
    std::uint32_t row;
    std::size_t slot;
    bool transposed;
  };

  /// Where each row goes, by approximate minimum degree.
  void order(std::span<const std::size_t> first, std::span<const std::uint32_t> rows) {
    std::vector<Eigen::Triplet<double>> pattern;
    for (std::size_t c = 0; c < size_; ++c)
      for (std::size_t s = first[c]; s < first[c + 1]; ++s) pattern.emplace_back(int(rows[s]), int(c), 1.0);
    const auto size = Eigen::Index(size_);
    Eigen::SparseMatrix<double> matrix(size, size);
    matrix.setFromTriplets(pattern.begin(), pattern.end());
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> row_at;
    if (size_ > 0) Eigen::AMDOrdering<int>()(matrix.selfadjointView<Eigen::Lower>(), row_at);
    place_.resize(size_);
    for (std::size_t i = 0; i < size_; ++i)
      place_[std::size_t(row_at.indices()[Eigen::Index(i)])] = std::uint32_t(i);
  }

  void permute(std::span<const std::size_t> first, std::span<const std::uint32_t> rows) {
    const auto column_of = [&](std::size_t c, std::size_t s) { return std::min(place_[c], place_[rows[s]]); };
    first_entry_.assign(size_ + 1, 0);
    for (std::size_t c = 0; c < size_; ++c)
      for (std::size_t s = first[c]; s < first[c + 1]; ++s) ++first_entry_[column_of(c, s) + 1];
    for (std::size_t c = 0; c < size_; ++c) first_entry_[c + 1] += first_entry_[c];
    std::vector<std::size_t> end(first_entry_.begin(), first_entry_.end() - 1);
    entries_.resize(rows.size());
    for (std::size_t c = 0; c < size_; ++c)
      for (std::size_t s = first[c]; s < first[c + 1]; ++s)
        entries_[end[column_of(c, s)]++] = {std::max(place_[c], place_[rows[s]]), s,
                                            place_[c] > place_[rows[s]]};
  }

  /// The pattern of `L` below the diagonal: that of the matrix, and of the columns that are eliminated before
  /// and whose first row this is.
  void find_pattern() {
    std::vector<std::vector<std::uint32_t>> children(size_);
    std::vector<std::uint32_t> seen_in(size_, ~std::uint32_t(0));
    first_.assign(1, 0);
    for (std::uint32_t j = 0; j < size_; ++j) {
      seen_in[j] = j;
      const auto add = [&](std::uint32_t row) {
        if (seen_in[row] != j) seen_in[row] = j, rows_.push_back(row);
      };
      for (std::size_t e = first_entry_[j]; e < first_entry_[j + 1]; ++e) add(entries_[e].row);
      for (const std::uint32_t k : children[j])
        for (std::size_t s = first_[k]; s < first_[k + 1]; ++s) add(rows_[s]);
      std::sort(rows_.begin() + std::ptrdiff_t(first_[j]), rows_.end());
      if (rows_.size() > first_[j]) children[rows_[first_[j]]].push_back(j);
      first_.push_back(rows_.size());
    }
    lower_.resize(rows_.size());
    diagonal_.resize(size_);
    inverse_diagonal_.resize(size_);
  }

  std::size_t size_ = 0;
  std::vector<std::uint32_t> place_;                // of each row
  std::vector<std::size_t> first_entry_;            // of each permuted column
  std::vector<entry> entries_;                      // of the matrix
  std::vector<std::size_t> first_;                  // of each column of L
  std::vector<std::uint32_t> rows_;                 // of L below the diagonal, increasing in a column
  std::vector<block> lower_;                        // L, without the diagonal, which is one
  std::vector<block> diagonal_, inverse_diagonal_;  // D
};

}  // namespace globalmatch::detail

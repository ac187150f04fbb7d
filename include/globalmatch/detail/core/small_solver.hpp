// Normal equations of up to six unknowns, as plain loops.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace globalmatch::detail {

/// A vector of up to six numbers; those past the size are zero.
using small_vector = std::array<double, 6>;

/// A square matrix of up to six rows, zero at first.
struct small_matrix {
  std::size_t size = 6;
  std::array<double, 36> numbers{};

  double operator()(std::size_t r, std::size_t c) const { return numbers[6 * c + r]; }
  double& operator()(std::size_t r, std::size_t c) { return numbers[6 * c + r]; }
  /// Adds weight * row * row.transpose().
  void add_square(const small_vector& row, double weight) {
    for (std::size_t c = 0; c < size; ++c) {
      if (row[c] == 0) continue;  // as of observations of one coordinate most are
      for (std::size_t r = 0; r < size; ++r) (*this)(r, c) += (weight * row[r]) * row[c];
    }
  }
};

/// L D L^T of a symmetric matrix, whose lower triangle is read; the largest of the diagonal comes first. What
/// the matrix leaves undetermined is set to zero by `solve`. Vectors have the bits of Eigen's LDLT.
class small_solver {
 public:
  explicit small_solver(const small_matrix& symmetric) : l_(symmetric) { factorize(); }

  /// False when the matrix has no such factors: it is indefinite with a zero diagonal, or not finite.
  bool succeeded() const { return succeeded_; }

  small_vector solve(small_vector b) const {
    const std::size_t n = l_.size;
    for (std::size_t k = 0; k < n; ++k) std::swap(b[k], b[swaps_[k]]);
    small_vector products{};
    for (std::size_t i = 1; i < n; ++i) {
      for (std::size_t j = 0; j < i; ++j) products[j] = l_(i, j) * b[j];
      b[i] -= sum_by_halves(products.data(), i);
    }
    for (std::size_t i = 0; i < n; ++i)
      b[i] = std::abs(l_(i, i)) > std::numeric_limits<double>::min() ? b[i] / l_(i, i) : 0;
    for (std::size_t i = n - 1; i-- > 0;) {
      for (std::size_t j = i + 1; j < n; ++j) products[j - i - 1] = l_(j, i) * b[j];
      b[i] -= sum_by_pairs(products.data(), n - i - 1);
    }
    for (std::size_t k = n; k-- > 0;) std::swap(b[k], b[swaps_[k]]);
    return b;
  }

  /// Has the bits of Eigen's solution for the identity, which takes rows four at a time.
  small_matrix inverse() const {
    small_matrix result;
    result.size = l_.size;
    for (std::size_t c = 0; c < l_.size; ++c) {
      const small_vector column = solve_in_panels(c);
      for (std::size_t r = 0; r < l_.size; ++r) result(r, c) = column[r];
    }
    return result;
  }

 private:
  small_matrix l_;  // below the diagonal L, on it D
  std::array<std::size_t, 6> swaps_{};
  bool succeeded_ = true;

  /// Solves for column `c` of the identity.
  small_vector solve_in_panels(std::size_t c) const {
    constexpr std::size_t panel = 4;
    const std::size_t n = l_.size;
    small_vector b{};
    b[c] = 1;
    for (std::size_t k = 0; k < n; ++k) std::swap(b[k], b[swaps_[k]]);
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t own = i / panel * panel;  // where the rows taken together with this one begin
      if (own > 0 && i == own)
        for (std::size_t r = own; r < n; ++r) b[r] -= sum_of_products(r, 0, own, b);
      for (std::size_t j = own; j < i; ++j) b[i] -= b[j] * l_(i, j);
    }
    for (std::size_t i = 0; i < n; ++i)
      b[i] = std::abs(l_(i, i)) > std::numeric_limits<double>::min() ? b[i] / l_(i, i) : 0;
    const std::size_t lower = n > panel ? n - panel : 0;  // rows from here on are taken first
    for (std::size_t i = n; i-- > lower;) b[i] -= sum_of_transposed(i, i + 1, n, b);
    for (std::size_t i = 0; i < lower; ++i) b[i] -= sum_of_transposed(i, lower, n, b);
    for (std::size_t i = lower; i-- > 0;) b[i] -= sum_of_transposed(i, i + 1, lower, b);
    for (std::size_t k = n; k-- > 0;) std::swap(b[k], b[swaps_[k]]);
    return b;
  }
  double sum_of_products(std::size_t row, std::size_t begin, std::size_t end, const small_vector& b) const {
    double sum = 0;
    for (std::size_t j = begin; j < end; ++j) sum += l_(row, j) * b[j];
    return sum;
  }
  double sum_of_transposed(std::size_t row, std::size_t begin, std::size_t end, const small_vector& b) const {
    double sum = 0;
    for (std::size_t j = begin; j < end; ++j) sum += l_(j, row) * b[j];
    return sum;
  }

  /// Two fixed orders of Eigen's: of numbers one by one, and of registers of two.
  static double sum_by_halves(const double* x, std::size_t n) {
    return n == 1 ? x[0] : sum_by_halves(x, n / 2) + sum_by_halves(x + n / 2, n - n / 2);
  }
  static double sum_by_pairs(const double* x, std::size_t n) {
    switch (n) {
      case 1:
        return x[0];
      case 2:
        return x[0] + x[1];
      case 3:
        return (x[0] + x[1]) + x[2];
      case 4:
        return (x[0] + x[2]) + (x[1] + x[3]);
      default:
        return ((x[0] + x[2]) + (x[1] + x[3])) + x[4];
    }
  }

  void exchange(std::size_t k, std::size_t p) {
    for (std::size_t j = 0; j < k; ++j) std::swap(l_(k, j), l_(p, j));
    for (std::size_t i = p + 1; i < l_.size; ++i) std::swap(l_(i, k), l_(i, p));
    std::swap(l_(k, k), l_(p, p));
    for (std::size_t i = k + 1; i < p; ++i) std::swap(l_(i, k), l_(p, i));
  }

  /// Subtracts from column k what the columns before it account for.
  void reduce_column(std::size_t k) {
    small_vector scaled{};
    for (std::size_t j = 0; j < k; ++j) scaled[j] = l_(j, j) * l_(k, j);
    for (std::size_t i = k; i < l_.size; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j < k; ++j) sum += l_(i, j) * scaled[j];
      l_(i, k) -= sum;
    }
  }

  void factorize() {
    bool singular = false;
    for (std::size_t k = 0; k < l_.size; ++k) {
      std::size_t pivot = k;
      for (std::size_t i = k + 1; i < l_.size; ++i)
        if (std::abs(l_(i, i)) > std::abs(l_(pivot, pivot))) pivot = i;
      swaps_[k] = pivot;
      if (pivot != k) exchange(k, pivot);
      if (k > 0) reduce_column(k);
      const bool usable = std::abs(l_(k, k)) > 0;
      for (std::size_t i = k + 1; i < l_.size; ++i) {
        if (usable) l_(i, k) /= l_(k, k);
        if (!usable && l_(i, k) != 0) succeeded_ = false;
      }
      if (usable && singular) succeeded_ = false;
      singular = singular || !usable;
    }
  }
};

}  // namespace globalmatch::detail

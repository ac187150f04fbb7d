// Normal equations of up to six unknowns, as plain loops.
#pragma once

#include <algorithm>
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
    for (std::size_t c = 0; c < size; ++c)
      for (std::size_t r = 0; r < size; ++r) (*this)(r, c) += (weight * row[r]) * row[c];
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
    for (std::size_t i = 0; i < n; ++i) b[i] = over_diagonal(b[i], i);
    for (std::size_t i = n - 1; i-- > 0;) {
      for (std::size_t j = i + 1; j < n; ++j) products[j - i - 1] = l_(j, i) * b[j];
      b[i] -= sum_by_pairs(products.data(), n - i - 1);
    }
    for (std::size_t k = n; k-- > 0;) std::swap(b[k], b[swaps_[k]]);
    return b;
  }

  /// With the bits that Eigen's LDLT has for a matrix on the right.
  small_matrix inverse() const {
    const std::size_t n = l_.size;
    small_matrix result;
    result.size = n;
    for (std::size_t c = 0; c < n; ++c) {
      small_vector x{};
      x[c] = 1;
      for (std::size_t k = 0; k < n; ++k) std::swap(x[k], x[swaps_[k]]);
      solve_lower_by_panels(x);
      for (std::size_t i = 0; i < n; ++i) x[i] = over_diagonal(x[i], i);
      solve_upper_by_panels(x);
      for (std::size_t k = n; k-- > 0;) std::swap(x[k], x[swaps_[k]]);
      for (std::size_t r = 0; r < n; ++r) result(r, c) = x[r];
    }
    return result;
  }

 private:
  small_matrix l_;  // below the diagonal L, on it D
  std::array<std::size_t, 6> swaps_{};
  bool succeeded_ = true;

  double over_diagonal(double x, std::size_t i) const {
    return std::abs(l_(i, i)) > std::numeric_limits<double>::min() ? x / l_(i, i) : 0;
  }

  /// Triangular systems in panels of four rows, what is left of them after each panel at once.
  static constexpr std::size_t panel = 4;
  void solve_lower_by_panels(small_vector& x) const {
    for (std::size_t begin = 0; begin < l_.size; begin += panel) {
      const std::size_t end = std::min(begin + panel, l_.size);
      for (std::size_t i = begin; i < end; ++i)
        for (std::size_t r = i + 1; r < end; ++r) x[r] -= x[i] * l_(r, i);
      for (std::size_t r = end; r < l_.size; ++r) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += l_(r, i) * x[i];
        x[r] -= sum;
      }
    }
  }
  void solve_upper_by_panels(small_vector& x) const {
    for (std::size_t end = l_.size; end > 0; end -= std::min(end, panel)) {
      const std::size_t begin = end - std::min(end, panel);
      for (std::size_t r = end; r-- > 0;) {
        double sum = 0;
        for (std::size_t i = r < begin ? begin : r + 1; i < end; ++i) sum += l_(i, r) * x[i];
        x[r] -= sum;
      }
    }
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

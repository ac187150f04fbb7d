#include "globalmatch/detail/core/small_solver.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "catch.hpp"
#include "oracles/eigen_bits.hpp"

namespace globalmatch::detail::test_small_solver {

using namespace oracles;

namespace {

using vector6 = Eigen::Matrix<double, 6, 1>;
using matrix6 = Eigen::Matrix<double, 6, 6>;

/// Positive definite but for what the kind says: singular, indefinite, or badly scaled.
matrix6 random_normal_matrix(numbers& random) {
  matrix6 m = matrix6::Zero();
  const auto kind = random.source() % 5;
  const int rows = kind == 1 ? 4 : 12;
  for (int i = 0; i < rows; ++i) {
    const vector6 row = random.matrix<vector6>();
    m += row * row.transpose();
  }
  if (kind == 2) m.row(3) *= 1e-6, m.col(3) *= 1e-6;
  if (kind == 3) {
    m.topRows<2>().setZero();
    m.leftCols<2>().setZero();
    m.topLeftCorner<2, 2>().setIdentity();
  }
  return m;
}
small_matrix plain(const matrix6& m, std::size_t size = 6) {
  small_matrix result;
  result.size = size;
  for (std::size_t c = 0; c < size; ++c)
    for (std::size_t r = 0; r < size; ++r) result(r, c) = m(Eigen::Index(r), Eigen::Index(c));
  return result;
}

}  // namespace

TEST_CASE("the solution of six normal equations has the bits of Eigen's LDLT") {
  always(20, [](numbers& random) {
    const matrix6 m = random_normal_matrix(random);
    const vector6 b = random.matrix<vector6>();
    const Eigen::LDLT<matrix6> oracle(m);
    const vector6 x = oracle.solve(b);
    small_vector right;
    for (int i = 0; i < 6; ++i) right[std::size_t(i)] = b[i];
    const small_solver solver(plain(m));
    const small_vector own = solver.solve(right);
    bool same = solver.succeeded() == (oracle.info() == Eigen::Success);
    for (int i = 0; i < 6; ++i) same = same && same_bits(own[std::size_t(i)], x[i]);
    return same;
  });
}

TEST_CASE("the inverse of a small matrix is that of Eigen's LDLT, of three to six rows") {
  numbers random(21);
  for (int i = 0; i < 1000; ++i) {
    matrix6 all = matrix6::Identity();
    for (int k = 0; k < 12; ++k) {
      const vector6 row = random.matrix<vector6>();
      all += row * row.transpose();
    }
    const auto size = 3 + Eigen::Index(random.source() % 4);
    const Eigen::MatrixXd m = all.topLeftCorner(size, size);
    const Eigen::MatrixXd inverse = m.ldlt().solve(Eigen::MatrixXd::Identity(size, size));
    const small_matrix own = small_solver(plain(all, std::size_t(size))).inverse();
    double error = 0;
    for (Eigen::Index r = 0; r < size; ++r)
      for (Eigen::Index c = 0; c < size; ++c)
        error = std::max(error, std::abs(own(std::size_t(r), std::size_t(c)) - inverse(r, c)));
    CHECK(error <= 1e-10 * inverse.cwiseAbs().maxCoeff());
  }
}

TEST_CASE("the solver says what has no factors, and leaves at zero what is not determined") {
  small_matrix indefinite;
  indefinite.size = 3;
  indefinite(0, 1) = indefinite(1, 0) = 1;
  CHECK_FALSE(small_solver(indefinite).succeeded());
  small_matrix zero;
  CHECK(small_solver(zero).succeeded());
  CHECK(small_solver(zero).solve({1, 2, 3, 4, 5, 6}) == small_vector{});
  small_matrix some;
  some.size = 4;
  some.add_square({1, 0, 0, 2}, 2);
  const small_vector x = small_solver(some).solve({2, 0, 0, 4});
  CHECK(x[0] + 2 * x[3] == Approx(1));
  CHECK((x[1] == 0 && x[2] == 0));
}

TEST_CASE("the solution satisfies its equations whichever of the diagonal comes first") {
  numbers random(22);
  for (int trial = 0; trial < 200; ++trial) {
    small_matrix m;
    m.size = 1 + std::size_t(trial % 6);
    for (int k = 0; k < 9; ++k) {
      small_vector row{};
      for (std::size_t i = 0; i < m.size; ++i) row[i] = random.next();
      m.add_square(row, 1 + random.unit());
    }
    small_vector truth{}, right{};
    for (std::size_t i = 0; i < m.size; ++i) truth[i] = random.unit() - 0.5;
    for (std::size_t r = 0; r < m.size; ++r)
      for (std::size_t c = 0; c < m.size; ++c) right[r] += m(r, c) * truth[c];
    const small_vector x = small_solver(m).solve(right);
    double size = 0, error = 0;
    for (std::size_t r = 0; r < m.size; ++r) {
      double sum = -right[r];
      for (std::size_t c = 0; c < m.size; ++c) {
        sum += m(r, c) * x[c];
        size = std::max(size, std::abs(m(r, c)));
      }
      error = std::max(error, std::abs(sum));
    }
    CHECK(error <= 1e-12 * size);
  }
}

TEST_CASE("a square that is added is the weight times the outer product, within the size alone") {
  small_matrix m;
  m.size = 3;
  m.add_square({2, -3, 5, 7, 7, 7}, 0.5);
  m.add_square({1, 0, 4, 7, 7, 7}, 2);
  const double expected[3][3] = {{4, -3, 13}, {-3, 4.5, -7.5}, {13, -7.5, 44.5}};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) CHECK(m(r, c) == expected[r][c]);
  for (std::size_t i = 3; i < 6; ++i) CHECK((m(i, 0) == 0 && m(0, i) == 0 && m(i, i) == 0));
}

}  // namespace globalmatch::detail::test_small_solver

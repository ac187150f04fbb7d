#include "globalmatch/detail/survey/block_system.hpp"

#include <Eigen/Dense>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_block_system {

using namespace detail;

namespace {

/// A system of blocks, and the same as a dense matrix.
template <int Dimension>
struct two_systems {
  using block = typename block_system<Dimension>::block;
  using vector = typename block_system<Dimension>::vector;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  block_system<Dimension> sparse;
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;

  two_systems(std::size_t size, std::vector<std::pair<std::uint32_t, std::uint32_t>> pattern)
      : pairs(pattern),
        sparse(size, std::move(pattern)),
        matrix(Eigen::MatrixXd::Zero(Eigen::Index(size) * Dimension, Eigen::Index(size) * Dimension)),
        right(Eigen::VectorXd::Zero(Eigen::Index(size) * Dimension)) {}

  Eigen::Index size() const { return matrix.rows() / Dimension; }
  auto dense(Eigen::Index row, Eigen::Index column) {
    return matrix.template block<Dimension, Dimension>(row * Dimension, column * Dimension);
  }

  /// Fills both so that they are positive definite: as sums of squares.
  void fill(random_source& random) {
    sparse.set_zero();
    matrix.setZero();
    const auto any = [&](auto m) {
      return decltype(m)(m.unaryExpr([&](double) { return random.normal(); }));
    };
    for (Eigen::Index i = 0; i < size(); ++i) {
      const block own = any(block(block::Zero())), square = own * own.transpose() + 0.01 * block::Identity();
      const vector summand = any(vector(vector::Zero()));
      sparse.add(std::size_t(i), std::size_t(i), square);
      sparse.add_right(std::size_t(i), summand);
      dense(i, i) += square;
      right.template segment<Dimension>(i * Dimension) = summand;
    }
    for (const auto& [a, b] : pairs) {
      const block j = any(block(block::Zero())), k = any(block(block::Zero()));
      sparse.add(a, a, j.transpose() * j);
      sparse.add(b, b, k.transpose() * k);
      sparse.add(a, b, j.transpose() * k);
      dense(a, a) += j.transpose() * j;
      dense(b, b) += k.transpose() * k;
      dense(a, b) += j.transpose() * k;
      dense(b, a) += k.transpose() * j;
    }
  }
};

/// Pairs of `size` blocks, some of them more than once and in both orders.
std::vector<std::pair<std::uint32_t, std::uint32_t>> random_pairs(std::size_t size, std::size_t count,
                                                                  random_source& random) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  while (size > 1 && pairs.size() < count) {
    const auto a = random.below(std::uint32_t(size)), b = random.below(std::uint32_t(size));
    if (a != b) pairs.emplace_back(a, b);
  }
  return pairs;
}

template <int Dimension>
void check_against_dense(std::size_t size, std::size_t pairs, random_source& random) {
  INFO("dimension " << Dimension << ", blocks " << size << ", pairs " << pairs);
  two_systems<Dimension> systems(size, random_pairs(size, pairs, random));
  for (int again = 0; again < 2; ++again) {  // the pattern serves for other numbers, too
    systems.fill(random);
    systems.right *= again + 1;
    for (Eigen::Index i = 0; again == 1 && i < systems.size(); ++i)
      systems.sparse.add_right(std::size_t(i), systems.right.template segment<Dimension>(i * Dimension) / 2);
    REQUIRE(systems.sparse.factorize());
    const Eigen::MatrixXd inverse = systems.matrix.inverse();
    const Eigen::VectorXd expected = inverse * systems.right;
    CHECK((systems.sparse.solve() - expected).norm() <= 1e-8 * (1 + expected.norm()));
    const auto blocks = systems.sparse.inverse_blocks();
    REQUIRE(blocks.size() == size);
    for (std::size_t i = 0; i < size; ++i) {
      const auto at = Eigen::Index(i) * Dimension;
      const auto block = inverse.block<Dimension, Dimension>(at, at);
      CHECK((blocks[i] - block).norm() <= 1e-8 * (1 + block.norm()));
    }
  }
}

}  // namespace

TEST_CASE("sparse systems of blocks have the solution and the inverse of dense ones") {
  random_source random(1);
  for (const std::size_t size : {1u, 2u, 7u, 40u})
    for (const std::size_t pairs : {std::size_t(0), size, 4 * size}) {
      check_against_dense<1>(size, pairs, random);
      check_against_dense<3>(size, pairs, random);
    }
}

TEST_CASE("blocks of the inverse are right where nothing and where all is connected") {
  random_source random(2);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> all;
  for (std::uint32_t a = 0; a < 12; ++a)
    for (std::uint32_t b = 0; b < a; ++b) all.emplace_back(a, b);
  two_systems<3> systems(12, all);
  systems.fill(random);
  REQUIRE(systems.sparse.factorize());
  const Eigen::MatrixXd inverse = systems.matrix.inverse();
  const auto blocks = systems.sparse.inverse_blocks();
  for (Eigen::Index i = 0; i < 12; ++i)
    CHECK((blocks[std::size_t(i)] - inverse.block<3, 3>(3 * i, 3 * i)).norm() < 1e-9);
}

TEST_CASE("a system without unknowns has an empty solution") {
  block_system<3> system(0, {});
  CHECK(system.factorize());
  CHECK(system.solve().size() == 0);
  CHECK(system.inverse_blocks().empty());
}

TEST_CASE("matrices that are not positive definite are not factorized") {
  block_system<3> system(2, {{0, 1}});
  CHECK_FALSE(system.factorize());  // all zero
  system.add(0, 0, Eigen::Matrix3d::Identity());
  CHECK_FALSE(system.factorize());  // nothing is known of the second block
  system.add(1, 1, Eigen::Matrix3d::Identity());
  CHECK(system.factorize());
  system.add(1, 0, 2 * Eigen::Matrix3d::Identity());
  CHECK_FALSE(system.factorize());  // indefinite
  system.set_zero();
  system.add(0, 0, Eigen::Matrix3d::Constant(std::nan("")));
  system.add(1, 1, Eigen::Matrix3d::Identity());
  CHECK_FALSE(system.factorize());  // not a number
}

}  // namespace globalmatch::test_block_system

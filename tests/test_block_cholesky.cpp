#include "globalmatch/detail/survey/block_cholesky.hpp"

#include <Eigen/Dense>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_block_cholesky {

using namespace detail;

TEST_CASE("the factors of a matrix of blocks give the solution and the inverse of the dense one") {
  random_source random(1);
  // A cycle of seven blocks, whose factors have more blocks than it has.
  constexpr std::uint32_t size = 7;
  std::vector<std::size_t> first = {0};
  std::vector<std::uint32_t> rows;
  std::vector<Eigen::Matrix2d> blocks;
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(2 * size, 2 * size);
  for (std::uint32_t c = 0; c < size; ++c) {
    for (std::uint32_t r = c; r < size; ++r) {
      if (r != c && r != c + 1 && !(c == 0 && r == size - 1)) continue;
      Eigen::Matrix2d block = Eigen::Matrix2d::NullaryExpr([&] { return random.normal(); });
      if (r == c) block = (block + block.transpose() + 12 * Eigen::Matrix2d::Identity()).eval();
      rows.push_back(r);
      blocks.push_back(block);
      dense.block<2, 2>(2 * r, 2 * c) = block;
      dense.block<2, 2>(2 * c, 2 * r) = block.transpose();
    }
    first.push_back(rows.size());
  }
  const Eigen::VectorXd right = Eigen::VectorXd::NullaryExpr(2 * size, [&] { return random.normal(); });
  block_cholesky<2> factors(first, rows);
  for (const double scale : {1.0, 3.0}) {  // the pattern serves again
    std::vector<Eigen::Matrix2d> scaled = blocks;
    for (Eigen::Matrix2d& b : scaled) b *= scale;
    REQUIRE(factors.factorize(scaled));
    CHECK((factors.solve(right) - (scale * dense).inverse() * right).norm() < 1e-12);
    const auto inverse = factors.inverse_blocks();
    REQUIRE(inverse.size() == size);
    for (std::uint32_t i = 0; i < size; ++i)
      CHECK((inverse[i] - (scale * dense).inverse().block<2, 2>(2 * i, 2 * i)).norm() < 1e-12);
  }
  for (const double wrong : {-1.0, 0.0, double(NAN)}) {
    std::vector<Eigen::Matrix2d> indefinite = blocks;
    indefinite[first[3]] *= wrong;
    CHECK_FALSE(factors.factorize(indefinite));
  }
}

}  // namespace globalmatch::test_block_cholesky

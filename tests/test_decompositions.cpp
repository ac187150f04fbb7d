#include "globalmatch/detail/core/decompositions.hpp"

#include <Eigen/Dense>

#include <cmath>

#include "catch.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "oracles/eigen_bits.hpp"

namespace globalmatch::detail::test_decompositions {

using namespace oracles;

TEST_CASE("the eigenvalues and vectors of a symmetric mat3 have the bits of Eigen's closed form") {
  always(15, [](numbers& random) {
    const eigen_mat a = random_symmetric(random);
    Eigen::SelfAdjointEigenSolver<eigen_mat> solver;
    solver.computeDirect(a);
    const eigen_of_mat3 e = symmetric_eigen(plain(a));
    return same_bits(e.values, solver.eigenvalues()) && same_bits(e.vectors, solver.eigenvectors());
  });
}

TEST_CASE("the eigenvectors of a symmetric mat3 diagonalise it, however few are distinct") {
  always(16, [](numbers& random) {
    const eigen_mat a = random_symmetric(random);
    const eigen_of_mat3 e = symmetric_eigen(plain(a));
    const eigen_mat v = to_eigen(rigid{e.vectors, {}}).linear();
    const double size = a.cwiseAbs().maxCoeff();
    return e.values.x <= e.values.y && e.values.y <= e.values.z && v.allFinite() &&
           std::abs(v.col(0).norm() - 1) < 1e-12 && std::abs(v.col(2).norm() - 1) < 1e-12 &&
           (v * to_eigen(e.values).asDiagonal() * v.transpose() - a).cwiseAbs().maxCoeff() <= 1e-6 * size;
  });
  const eigen_of_mat3 zero = symmetric_eigen(mat3{}), equal = symmetric_eigen(mat3::diagonal_of({4, 4, 4}));
  CHECK((zero.values == vec3{} && zero.vectors == mat3::identity()));
  CHECK((equal.values == vec3{4, 4, 4} && equal.vectors == mat3::identity()));
}

TEST_CASE("the eigenvalues and vectors of a symmetric mat2 have the bits of Eigen's closed form") {
  always(17, [](numbers& random) {
    Eigen::Matrix2d a = random.matrix<Eigen::Matrix2d>();
    a(0, 1) = a(1, 0);
    if (random.unit() < 0.2) a = a.col(0) * a.col(0).transpose();
    if (random.unit() < 0.1) a = a(0, 0) * Eigen::Matrix2d::Identity();
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver;
    solver.computeDirect(a);
    const eigen_of_mat2 e = symmetric_eigen(plain(a));
    return same_bits(e.values, solver.eigenvalues()) && same_bits(e.vectors, solver.eigenvectors());
  });
}

TEST_CASE("the rotation of a covariance has the bits of Eigen's JacobiSVD") {
  always(18, [](numbers& random) {
    eigen_mat a = random.matrix<eigen_mat>();
    if (random.unit() < 0.2) a.col(2) = a.col(0) - 2 * a.col(1);
    if (random.unit() < 0.1) a = a.col(0) * a.col(1).transpose();
    if (random.unit() < 0.1) a = random_symmetric(random);
    const Eigen::JacobiSVD<eigen_mat> svd(a, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const eigen_mat v = svd.matrixV(), u = svd.matrixU();
    const double handedness = (v * u.transpose()).determinant() < 0 ? -1 : 1;
    Eigen::Isometry3d r;  // to whose part Eigen assigns number by number, not two at a time
    r.linear() = v * eigen_vec(1, 1, handedness).asDiagonal() * u.transpose();
    const svd_of_mat3 own(plain(a));
    const rotation_of_covariance fit(plain(a));
    return same_bits(own.values, svd.singularValues()) && same_bits(own.u, u) && same_bits(own.v, v) &&
           same_bits(fit.rotation, r.linear()) && fit.singular_values == own.values;
  });
}

TEST_CASE("the rotation of a covariance turns the source onto the target, mirrored points too") {
  numbers random(19);
  for (int i = 0; i < 200; ++i) {
    const eigen_mat truth = random.rotation();
    eigen_mat covariance = eigen_mat::Zero();
    for (int k = 0; k < 5; ++k) {
      const eigen_vec p = random.vector();
      covariance += p * (truth * p).transpose();
    }
    CHECK((to_eigen(rigid{rotation_of_covariance(plain(covariance)).rotation, {}}).linear() - truth).norm() <
          1e-9);
    const mat3 mirrored = rotation_of_covariance(plain(eigen_mat(-covariance))).rotation;
    CHECK(mirrored.determinant() == Approx(1));
  }
  CHECK(rotation_of_covariance(mat3{}).rotation == mat3::identity());
  CHECK(rotation_of_covariance(mat3{}).singular_values == vec3{});
}

}  // namespace globalmatch::detail::test_decompositions

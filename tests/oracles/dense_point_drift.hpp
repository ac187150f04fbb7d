// One iteration of rigid coherent point drift in two dimensions as Myronenko and Song (2010, Fig. 2) write
// it, with matrices, at scale 1.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <Eigen/SVD>

#include <cmath>
#include <numbers>

namespace globalmatch::oracles {

struct drift_step {
  Eigen::Matrix2d rotation;
  Eigen::Vector2d translation;
  double variance;
};

/// `x` are the N data points, `y` the M centroids, one a row; `before` is where they stand.
inline drift_step dense_drift_step(const Eigen::MatrixX2d& x, const Eigen::MatrixX2d& y,
                                   const drift_step& before, double w) {
  const double n = double(x.rows()), m = double(y.rows());
  Eigen::MatrixXd p(y.rows(), x.rows());
  for (Eigen::Index j = 0; j < x.rows(); ++j) {
    for (Eigen::Index i = 0; i < y.rows(); ++i) {
      const Eigen::Vector2d at = before.rotation * y.row(i).transpose() + before.translation;
      p(i, j) = std::exp(-(x.row(j).transpose() - at).squaredNorm() / (2 * before.variance));
    }
    p.col(j) /= p.col(j).sum() + 2 * std::numbers::pi * before.variance * w / (1 - w) * m / n;
  }
  const double total = p.sum();
  const Eigen::VectorXd p1 = p.rowwise().sum(), pt1 = p.colwise().sum().transpose();
  const Eigen::Vector2d mean_x = x.transpose() * pt1 / total, mean_y = y.transpose() * p1 / total;
  const Eigen::MatrixX2d x_hat = x.rowwise() - mean_x.transpose(), y_hat = y.rowwise() - mean_y.transpose();
  const Eigen::Matrix2d a = x_hat.transpose() * p.transpose() * y_hat;
  const Eigen::JacobiSVD<Eigen::Matrix2d> svd(a, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix2d uvt = svd.matrixU() * svd.matrixV().transpose();
  const Eigen::Matrix2d c = Eigen::Vector2d(1, uvt.determinant()).asDiagonal();
  drift_step after;
  after.rotation = svd.matrixU() * c * svd.matrixV().transpose();
  after.translation = mean_x - after.rotation * mean_y;
  const double of_x = (x_hat.transpose() * pt1.asDiagonal() * x_hat).trace(),
               of_y = (y_hat.transpose() * p1.asDiagonal() * y_hat).trace();
  after.variance = (of_x + of_y - 2 * (a.transpose() * after.rotation).trace()) / (2 * total);
  return after;
}

}  // namespace globalmatch::oracles

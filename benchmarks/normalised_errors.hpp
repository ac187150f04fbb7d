// Normalised errors: the squared Mahalanobis distance of errors over their degrees of freedom, by the
// uncertainty that was reported. Their root mean square is 1, and 0.3 % lie above the 99.7 % quantile, if the
// uncertainty is right.
#pragma once

#include <globalmatch/matching.hpp>

#include <Eigen/Dense>

#include <cmath>
#include <cstddef>
#include <iomanip>
#include <ostream>

namespace globalmatch::benchmarks {

class normalised_errors {
 public:
  /// Counts the error of a registration at the place where its uncertainty is given.
  void add(const Eigen::Isometry3d& target_from_source, const Eigen::Isometry3d& truth,
           const transform_uncertainty& u, bool height_is_known) {
    const Eigen::Vector3d error = target_from_source * truth.inverse() * u.center - u.center;
    const Eigen::Matrix3d covariance = u.at(u.center);
    const Eigen::Vector2d in_plan = error.head<2>();
    plan_.add(in_plan.dot(covariance.topLeftCorner<2, 2>().ldlt().solve(in_plan)) / 2, 11.618 / 2);
    if (height_is_known) height_.add(error.z() * error.z() / covariance(2, 2), 8.807);
  }

  /// Two cells of a table, in plan and in height: root mean square, share above the quantile [%], number.
  friend std::ostream& operator<<(std::ostream& out, const normalised_errors& e) {
    return out << e.plan_ << " | " << e.height_;
  }

 private:
  struct component {
    std::size_t count = 0, above = 0;
    double sum = 0;

    void add(double squared, double quantile) {
      ++count;
      sum += squared;
      above += squared > quantile;
    }
    friend std::ostream& operator<<(std::ostream& out, const component& c) {
      if (c.count == 0) return out << "-";
      const double n = static_cast<double>(c.count);
      return out << std::fixed << std::setprecision(2) << std::sqrt(c.sum / n) << ", "
                 << 100 * static_cast<double>(c.above) / n << " % of " << c.count;
    }
  };
  component plan_, height_;
};

}  // namespace globalmatch::benchmarks

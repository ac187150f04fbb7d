// How far apart matched stems are, beside what is to be expected.
#pragma once

#include <globalmatch/matching.hpp>

#include <Eigen/Core>

#include <optional>
#include <ostream>
#include <vector>

#include "support/report/stem_plans.hpp"

namespace globalmatch::support {

/// A pair of stems in the upright frame of the target.
struct stem_residual {
  stem_index source = 0, target = 0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();     ///< [m] of the target's stem
  Eigen::Vector3d residual = Eigen::Vector3d::Zero();  ///< [m] from there to that of the source
  Eigen::Matrix2d expected = Eigen::Matrix2d::Zero();  ///< [m^2] covariance of the residual in plan
  double share = 0;  ///< of the distance in that direction within which 95 % should lie
};

/// Residuals under a transform. One in plan has the variances of both stems, as mapping has them but scaled
/// to the median of all residuals, and that of the transform at its place. Empty where there is no transform.
std::vector<stem_residual> residuals_of(const upright_map& source, const upright_map& target,
                                        const shown_transform& shown,
                                        const std::optional<transform_uncertainty>& uncertainty);

/// Draws the residuals in plan, enlarged, with the ellipses within which 95 % of each should lie. Those that
/// do not are orange, with the numbers of their rows, counted from 1.
void draw_residuals(std::ostream& out, const std::vector<stem_residual>& residuals);

}  // namespace globalmatch::support

// Links of a survey: pairs of maps whose stems agree.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/matching/uncertainty.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/matching.hpp"

namespace globalmatch::detail {

/// Two maps whose stems agree, or targets that both show, in their levelled local frames.
struct survey_link {
  std::uint32_t source = 0, target = 0;
  plan_pose target_from_source;
  vec2 center;      ///< [m] centroid of the paired stems or targets, in the target
  mat3 covariance;  ///< of a shift of `center` [m] and a turn about it [rad], along the axes of the target
  double log10_nfa = 0;
  double inlier_threshold = 0, rms = 0;  ///< [m]
  std::vector<correspondence> correspondences;
  std::vector<correspondence> targets = {};  ///< that link the maps, which need no stems then, by their
                                             ///< numbers in the options
  double target_raise = 0;                   ///< [m] by which these are higher in the target map
  std::size_t supporting_cycles = 0;
  bool used = true;

  bool is_of_targets() const { return !targets.empty(); }
  vec2 center_in_source() const { return target_from_source.inverse() * center; }
};

/// [rad] Half a millimetre at 10 m: of a turn, errors have that in common, as of a shift.
inline constexpr double shared_yaw_sigma = 5e-5;

/// Median [m] of how much higher the paired stems of a link are in the target than in the source; of targets
/// the mean.
inline double raise_of(std::span<const prepared_stems> maps, const survey_link& l) {
  if (l.is_of_targets()) return l.target_raise;
  std::vector<double> above;
  for (const correspondence& c : l.correspondences)
    above.push_back(maps[l.target].stems.at[c.target].z - maps[l.source].stems.at[c.source].z);
  return median(above);
}

/// What of a covariance of shift and turn about the vertical is in plan. It has an inverse also where stems
/// agree to the bit, as those of a map and its copy do.
inline mat3 plan_covariance(const local_uncertainty& u) {
  mat3 covariance = mat3::diagonal_of({0, 0, shared_yaw_sigma * shared_yaw_sigma});
  const std::size_t of[3] = {0, 1, 3};
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) covariance(r, c) += u.covariance(of[r], of[c]);
  return covariance;
}

}  // namespace globalmatch::detail

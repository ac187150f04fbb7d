// What is known of the places of scans besides their stems: the frame of the survey.
#pragma once

#include <globalmatch/survey_options.hpp>

#include <Eigen/Geometry>

#include <filesystem>
#include <string>
#include <vector>

#include "support/programs/survey_command.hpp"
#include "support/programs/survey_priors.hpp"
#include "support/programs/survey_targets.hpp"
#include "support/programs/survey_work.hpp"

namespace globalmatch::support {

/// A scan whose place in the survey's frame is known.
struct named_fixed_scan {
  std::string name;
  Eigen::Isometry3d survey_from_scan;
};

struct survey_constraints {
  std::vector<named_fixed_scan> fixed;
  std::vector<named_prior> priors;
  std::vector<named_target> targets;

  /// Reads what the command names. Throws `file_error`, and `std::invalid_argument` naming a bad option.
  static survey_constraints read(const survey_command& command);

  /// The options for the maps at hand. The reference is that of an earlier run in `out_dir`. Priors and
  /// targets of scans that were not mapped are left out, and named on standard error. Throws
  /// `std::invalid_argument` where a fixed scan was not mapped.
  survey_options options_for(const survey_work& work, const std::filesystem::path& out_dir) const;
};

/// Names the scans that their priors have elsewhere than the survey, by more than four standard deviations,
/// fixed ones that were not held, targets that do not fit, and components whose frame is not the one that was
/// asked for, on standard error.
void report_constraints(const survey& result, const survey_options& options,
                        const std::vector<std::string>& names);

}  // namespace globalmatch::support

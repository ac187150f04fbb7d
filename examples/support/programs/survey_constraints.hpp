// What is known of the places of scans besides their stems: the frame of the survey.
#pragma once

#include <globalmatch/survey_options.hpp>

#include <Eigen/Geometry>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "support/programs/survey_command.hpp"
#include "support/programs/survey_control.hpp"
#include "support/programs/survey_inputs.hpp"
#include "support/programs/survey_priors.hpp"
#include "support/programs/survey_targets.hpp"
#include "support/programs/survey_work.hpp"

namespace globalmatch::support {

/// A scan whose place in the survey's frame is known.
struct named_fixed_scan {
  std::string name;
  Eigen::Isometry3d survey_from_scan;
};

/// A scan whose vertical is known.
struct named_level {
  std::string name;
  double sigma;  ///< [rad]
};

struct survey_constraints {
  std::vector<named_fixed_scan> fixed;
  std::vector<named_prior> priors;
  std::vector<named_level> levels;
  std::optional<control_map> control;
  std::vector<named_target> targets;

  /// Reads what the command names. Throws `file_error`, and `std::invalid_argument` naming a bad option.
  static survey_constraints read(const survey_command& command);

  /// Throws `std::invalid_argument` where the inputs have no scan that is fixed or levelled, naming the
  /// nearest name, or have one that is named as the control. Priors of such scans are left out, and named on
  /// standard error.
  void require_names(const std::vector<survey_input>& inputs);

  /// The options for the maps at hand. The reference is that of an earlier run in `out_dir`. Priors and
  /// targets of scans that were not mapped are left out, and named on standard error. Throws `std::invalid_argument` where a
  /// fixed or levelled scan was not mapped, or a levelled one with the vertical of its stems.
  survey_options options_for(const survey_work& work, const std::filesystem::path& out_dir) const;
};

/// Names the scans that their priors or levels have elsewhere than the survey, by more than four standard
/// deviations, fixed ones that were not held, targets that do not fit, and components whose frame is not the one that was asked for,
/// on standard error.
void report_constraints(const survey& result, const survey_options& options, const survey_work& work);

}  // namespace globalmatch::support

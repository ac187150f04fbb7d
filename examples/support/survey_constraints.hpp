// What is known of the places of scans besides their stems: the frame of the survey.
#pragma once

#include <globalmatch/survey_options.hpp>

#include <Eigen/Geometry>

#include <filesystem>
#include <optional>
#include <string>

#include "support/survey_command.hpp"
#include "support/survey_work.hpp"

namespace globalmatch::support {

/// A scan whose place in the survey's frame is known.
struct fixed_scan {
  std::string name;
  Eigen::Isometry3d survey_from_scan;
};

struct survey_constraints {
  std::optional<fixed_scan> fixed;

  /// Reads what the command names. Throws `file_error`, and `std::invalid_argument` naming a bad option.
  static survey_constraints read(const survey_command& command);

  /// The options for the maps at hand. The reference is the fixed scan, else that of an earlier run in
  /// `out_dir`. Throws `std::invalid_argument` where the fixed scan was not mapped.
  survey_options options_for(const survey_work& work, const std::filesystem::path& out_dir) const;

  /// Puts the component of the reference into the frame that is known.
  void apply_to(survey& result, const survey_options& options) const;
};

}  // namespace globalmatch::support

// Whether a result can be trusted, in words and in the numbers that tell.
#pragma once

#include <globalmatch/registration_options.hpp>
#include <globalmatch/survey_options.hpp>

#include <string>
#include <vector>

#include "support/programs/survey_files.hpp"

namespace globalmatch::support {

enum class trust_level {
  full,     ///< it can be used as it is
  partial,  ///< part of it can, or it should be looked at before
  none
};

struct trust_figure {
  std::string label, value, note = {};
};

struct trust_statement {
  trust_level level = trust_level::none;
  std::string headline;
  std::vector<std::string> sentences;
  std::vector<trust_figure> figures;
};

/// Root mean square error [m] in plan that an uncertainty tells to expect at a place of the target.
double horizontal_error(const transform_uncertainty& uncertainty, const Eigen::Vector3d& place);

/// Of the registration of two scans. `needs_height`: a transform whose height is not known counts as none.
trust_statement trust_in(const registration& result, bool needs_height);

/// Of a survey, and of each of its inputs.
trust_statement trust_in(const std::vector<survey_row>& rows, const survey& result);

}  // namespace globalmatch::support

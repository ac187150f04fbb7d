// Ground control: trees whose positions in the survey's frame are known, as one more map, which is no scan.
#pragma once

#include <globalmatch/stem_map.hpp>
#include <globalmatch/survey_options.hpp>

#include <nlohmann/json.hpp>

#include <filesystem>
#include <optional>
#include <vector>

#include "support/programs/survey_inputs.hpp"
#include "support/programs/survey_work.hpp"

namespace globalmatch::support {

struct control_map {
  survey_input input;  ///< the table; its name is `control`
  stem_map map;
};

/// Reads a table of stems in the survey's coordinates. Throws `file_error`, also for fewer than four trees.
control_map read_control(const std::filesystem::path& file);

/// Throws `std::invalid_argument` where one of the inputs has the name of the control.
void require_no_control(const std::vector<survey_input>& inputs);

/// Appends it behind the maps of all scans, if there are any.
void add_control(survey_work& work, const control_map& control);

/// Leaves out the trees that no scan saw, and, where no tree of the control was recognised, its component,
/// and says so on standard error.
void leave_out_unseen_control(survey& result, const survey_work& work);

/// By how much distances in the control are longer than in the scans: a similarity transform for each scan
/// that is linked to it, of which the scales are averaged. What the sigma takes for independent are the trees
/// of the control, as several scans repeat the error of one.
struct control_scale {
  double factor = 1, sigma = 0;
  std::size_t trees = 0, links = 0;  ///< of the control that scans saw, and scans with a scale
  bool differs() const;              ///< by what matters, beyond doubt
};

/// Nothing where no scan sees four of its trees.
std::optional<control_scale> scale_of_control(const survey& result, const survey_work& work);

/// `{scale, sigma, trees, links}`, null where there is none, and says on standard error where the scale
/// differs.
nlohmann::ordered_json report_control(const survey& result, const survey_work& work);

}  // namespace globalmatch::support

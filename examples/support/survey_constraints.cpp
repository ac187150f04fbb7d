#include "support/survey_constraints.hpp"

#include <stdexcept>

#include "support/survey_files.hpp"
#include "support/transform_files.hpp"

namespace globalmatch::support {

namespace {

std::optional<fixed_scan> read_fixed(const std::string& given) {
  if (given.empty()) return std::nullopt;
  const std::size_t equals = given.rfind('=');
  if (equals == std::string::npos || equals == 0)
    throw std::invalid_argument("--fix " + given + ": NAME=T.txt is needed, the scan's name and its matrix");
  return fixed_scan{given.substr(0, equals), read_transform(given.substr(equals + 1))};
}

}  // namespace

survey_constraints survey_constraints::read(const survey_command& command) {
  return {.fixed = read_fixed(command.fix)};
}

survey_options survey_constraints::options_for(const survey_work& work,
                                               const std::filesystem::path& out_dir) const {
  survey_options options;
  options.reference = work.index_of(fixed ? fixed->name : recorded_reference(out_dir / "survey.json"));
  if (fixed && !options.reference)
    throw std::invalid_argument("--fix " + fixed->name + ": no scan of that name was mapped");
  return options;
}

void survey_constraints::apply_to(survey& result, const survey_options& options) const {
  if (fixed) transform_survey(result, result.scans[*options.reference].component, fixed->survey_from_scan);
}

}  // namespace globalmatch::support

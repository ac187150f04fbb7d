#include "support/survey_constraints.hpp"

#include <cmath>
#include <iostream>
#include <stdexcept>

#include "support/survey_files.hpp"
#include "support/transform_files.hpp"

namespace globalmatch::support {

namespace {

named_fixed_scan read_fixed(const std::string& given) {
  const std::size_t equals = given.rfind('=');
  if (equals == std::string::npos || equals == 0)
    throw std::invalid_argument("--fix " + given + ": NAME=T.txt is needed, the scan's name and its matrix");
  return {given.substr(0, equals), read_transform(given.substr(equals + 1))};
}

}  // namespace

survey_constraints survey_constraints::read(const survey_command& command) {
  survey_constraints known;
  for (const std::string& given : command.fix) known.fixed.push_back(read_fixed(given));
  if (!command.priors.empty()) known.priors = read_priors(command.priors);
  return known;
}

survey_options survey_constraints::options_for(const survey_work& work,
                                               const std::filesystem::path& out_dir) const {
  survey_options options;
  options.reference = work.index_of(recorded_reference(out_dir / "survey.json"));
  for (const named_fixed_scan& f : fixed) {
    const auto scan = work.index_of(f.name);
    if (!scan) throw std::invalid_argument("--fix " + f.name + ": no scan of that name was mapped");
    options.fixed.push_back({*scan, f.survey_from_scan});
  }
  for (const named_prior& p : priors) {
    const auto scan = work.index_of(p.scan);
    if (!scan) {
      std::cerr << p.scan << ": no scan of that name was mapped; its prior is left out\n";
      continue;
    }
    options.priors.push_back(p.measured);
    options.priors.back().scan = *scan;
  }
  return options;
}

void report_priors(const survey& result, const std::vector<std::string>& names) {
  constexpr double agreeing = 4;  // standard deviations
  for (std::size_t i = 0; i < names.size(); ++i)
    if (const double off = result.scans[i].prior_deviations; off > agreeing)
      std::cerr << names[i] << ": its prior is " << std::lround(off)
                << " standard deviations off, and was left out\n";
}

}  // namespace globalmatch::support

#include "support/programs/survey_constraints.hpp"

#include <cmath>
#include <iostream>
#include <numbers>
#include <stdexcept>

#include "support/programs/survey_files.hpp"
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
  if (!command.targets.empty()) known.targets = read_targets(command.targets);
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
  options.targets = targets_of(targets, work);
  return options;
}

void report_constraints(const survey& result, const survey_options& options,
                        const std::vector<std::string>& names) {
  constexpr double known_yaw = 0.05;  // [rad]
  for (std::size_t c = 0; c < result.frames.size(); ++c) {
    const survey::frame& frame = result.frames[c];
    const std::string component = "component " + std::to_string(c) + ": ";
    if (frame.source == survey::frame_source::reference && !(options.fixed.empty() && options.priors.empty()))
      std::cerr << component << "none of its scans is fixed or has a prior; its frame is that of a scan\n";
    if (!std::isfinite(frame.yaw_sigma))
      std::cerr << component
                << "its priors do not tell the direction of its frame, which is that of a scan\n";
    else if (frame.yaw_sigma > known_yaw)
      std::cerr << component << "its priors tell the direction of its frame to "
                << std::lround(frame.yaw_sigma * 180 / std::numbers::pi) << " degrees only\n";
  }
  constexpr double agreeing = 4;  // standard deviations
  for (std::size_t i = 0; i < names.size(); ++i)
    if (const double off = result.scans[i].fixed_distance; off > 0)
      std::cerr << names[i] << ": its fixed pose is " << off
                << " m from where its stems place it beside other fixed scans, and was left out\n";
  for (std::size_t i = 0; i < names.size(); ++i)
    if (const double off = result.scans[i].prior_deviations; off > agreeing)
      std::cerr << names[i] << ": its prior is " << std::lround(off) << " standard deviations off\n";
  report_targets(result, names);
}

}  // namespace globalmatch::support

#include "support/programs/survey_constraints.hpp"

#include <globalmatch/detail/survey/survey_frames.hpp>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <numbers>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "support/programs/near_names.hpp"
#include "support/programs/survey_files.hpp"
#include "support/text_fields.hpp"
#include "support/transform_files.hpp"

namespace globalmatch::support {

namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double agreeing = 4;  // standard deviations

named_fixed_scan read_fixed(const std::string& given) {
  const std::size_t equals = given.rfind('=');
  if (equals == std::string::npos || equals == 0)
    throw std::invalid_argument("--fix " + given + ": NAME=T.txt is needed, the scan's name and its matrix");
  return {given.substr(0, equals), read_transform(given.substr(equals + 1))};
}

named_level read_level(const std::string& given) {
  const std::size_t comma = given.rfind(',');
  const auto degrees = comma == std::string::npos ? std::nullopt : to_number(given.substr(comma + 1));
  if (!degrees || comma == 0 || !(*degrees > 0) || !std::isfinite(*degrees))
    throw std::invalid_argument("--level " + given +
                                ": NAME,SIGMA_DEG is needed, the scan's name and how well its vertical is "
                                "known, in degrees above 0");
  return {given.substr(0, comma), *degrees * degree};
}

std::string in_degrees(double radians) {
  std::ostringstream text;
  text << std::setprecision(2) << radians / degree << " degrees";
  return std::move(text).str();
}

/// The vertical of a component in the frame of the survey; nothing where it has a map alone.
std::optional<Eigen::Vector3d> vertical_of(const survey& result, int component) {
  for (const survey::scan& scan : result.scans)
    if (scan.component == component && scan.uncertainty) return scan.uncertainty->up;
  return std::nullopt;
}

void report_frames(const survey& result, const survey_options& options) {
  constexpr double known_yaw = 0.05, max_lean = 0.004;  // [rad]
  for (std::size_t c = 0; c < result.frames.size(); ++c) {
    const survey::frame& frame = result.frames[c];
    const std::string component = "component " + std::to_string(c) + ": ";
    if (frame.source == survey::frame_source::reference && !(options.fixed.empty() && options.priors.empty()))
      std::cerr << component << "nothing that was given places it; its frame is that of a scan\n";
    if (!std::isfinite(frame.yaw_sigma))
      std::cerr << component
                << "its priors do not tell the direction of its frame, which is that of a scan\n";
    else if (frame.yaw_sigma > known_yaw)
      std::cerr << component << "its priors tell the direction of its frame to "
                << std::lround(frame.yaw_sigma / degree) << " degrees only\n";
    const auto vertical = vertical_of(result, int(c));
    if (options.levels.empty() || !vertical) continue;
    if (const double lean = detail::angle_between(*vertical, Eigen::Vector3d(0, 0, 1)); lean > max_lean)
      std::cerr << component << "its frame leans by " << in_degrees(lean)
                << ", as the scan or the fixed pose that it is taken from\n";
  }
}

void report_fixed(const survey& result, const survey_options& options, const survey_work& work) {
  for (const survey_options::fixed_scan& f : options.fixed) {
    const survey::scan& scan = result.scans[f.scan];
    const std::string what = f.scan == work.control ? "frame" : "fixed pose";
    if (scan.fixed_distance > 0)
      std::cerr << work.names[f.scan] << ": its " << what << " is " << scan.fixed_distance
                << " m from where its stems place it beside other fixed scans, and was left out\n";
    else if (scan.uncertainty && !detail::is_held(scan))
      std::cerr << work.names[f.scan] << ": its " << what
                << " agrees with the survey, but was not held: some scan would have lost its place by that\n";
  }
}

void report_levels(const survey& result, const survey_options& options, const survey_work& work) {
  for (const survey_options::level& l : options.levels) {
    const survey::scan& scan = result.scans[l.scan];
    if (!scan.uncertainty) continue;
    const Eigen::Vector3d up = scan.survey_from_scan.linear() * work.maps[l.scan].up;
    const double off = detail::angle_between(up, scan.uncertainty->up);
    if (off > agreeing * l.sigma)
      std::cerr << work.names[l.scan] << ": its vertical is " << in_degrees(off)
                << " off that of the survey, more than its --level allows\n";
  }
}

}  // namespace

survey_constraints survey_constraints::read(const survey_command& command) {
  survey_constraints known;
  for (const std::string& given : command.fix) known.fixed.push_back(read_fixed(given));
  if (!command.priors.empty()) known.priors = read_priors(command.priors);
  for (const std::string& given : command.levels) known.levels.push_back(read_level(given));
  if (!command.control.empty()) known.control = read_control(command.control);
  if (!command.targets.empty()) known.targets = read_targets(command.targets);
  return known;
}

void survey_constraints::require_names(const std::vector<survey_input>& inputs) {
  std::vector<std::string> names;
  for (const survey_input& input : inputs) names.push_back(input.name);
  const auto is_there = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const auto require = [&](const std::string& option, const auto& given) {
    std::set<std::string> before;
    for (const auto& g : given) {
      if (!is_there(g.name))
        throw std::invalid_argument(option + g.name + ": no scan of that name; " +
                                    suggest_name(g.name, names));
      if (!before.insert(g.name).second)
        throw std::invalid_argument(option + g.name + ": it is given twice; which one is right?");
    }
  };
  require("--fix ", fixed);
  require("--level ", levels);
  if (control) require_no_control(inputs);
  std::erase_if(priors, [&](const named_prior& p) {
    if (is_there(p.scan)) return false;
    std::cerr << p.scan << ": no scan of that name, and its prior is left out; "
              << suggest_name(p.scan, names) << '\n';
    return true;
  });
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
  if (work.control) options.fixed.push_back({*work.control, Eigen::Isometry3d::Identity()});
  for (const named_level& l : levels) {
    const auto scan = work.index_of(l.name);
    if (!scan) throw std::invalid_argument("--level " + l.name + ": no scan of that name was mapped");
    if (work.maps[*scan].up_by_stems)
      throw std::invalid_argument(
          "--level " + l.name + ": its map has the vertical of its stems, which lean; add --vertical given");
    options.levels.push_back({*scan, l.sigma});
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

void report_constraints(const survey& result, const survey_options& options, const survey_work& work) {
  report_frames(result, options);
  report_fixed(result, options, work);
  report_levels(result, options, work);
  for (std::size_t i = 0; i < work.names.size(); ++i)
    if (const double off = result.scans[i].prior_deviations; off > agreeing)
      std::cerr << work.names[i] << ": its prior is " << std::lround(off) << " standard deviations off\n";
  report_targets(result, work.names);
}

}  // namespace globalmatch::support

#include "support/programs/survey_control.hpp"

#include <globalmatch/detail/core/vectors.hpp>
#include <globalmatch/detail/matching/scale_fit.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "support/content_hash.hpp"
#include "support/file_error.hpp"
#include "support/programs/survey_maps.hpp"

namespace globalmatch::support {

namespace {

constexpr const char* control_name = "control";

/// Places of the trees that a scan and the control both have, in plan, in the frame of the survey.
struct common_places {
  std::vector<detail::vec2> of_scan, of_control;
};

/// Of each scan.
std::vector<common_places> places_in_common(const survey& result, const survey_work& work) {
  const auto place_of = [&](const survey::observation& o) {
    const Eigen::Vector3d p =
        result.scans[o.scan].survey_from_scan * work.maps[o.scan].stems[o.stem].position;
    return detail::vec2{p.x(), p.y()};
  };
  std::vector<common_places> common(result.scans.size());
  for (const survey::tree& t : result.trees) {
    const auto control =
        std::find_if(t.seen.begin(), t.seen.end(), [&](const auto& o) { return o.scan == *work.control; });
    if (control == t.seen.end()) continue;
    for (const survey::observation& o : t.seen) {
      if (o.scan == *work.control) continue;
      common[o.scan].of_scan.push_back(place_of(o));
      common[o.scan].of_control.push_back(place_of(*control));
    }
  }
  return common;
}

std::size_t trees_of_control(const survey& result, std::size_t control) {
  return std::size_t(std::count_if(result.trees.begin(), result.trees.end(), [&](const survey::tree& t) {
    return t.seen.size() > 1 &&
           std::any_of(t.seen.begin(), t.seen.end(), [&](const auto& o) { return o.scan == control; });
  }));
}

std::string describe(const control_scale& scale) {
  constexpr int digits = 5;  // ten millionths are below any sigma
  std::ostringstream text;
  text << std::fixed << std::setprecision(digits) << scale.factor << " (+-" << scale.sigma << ")";
  return std::move(text).str();
}

}  // namespace

control_map read_control(const std::filesystem::path& file) {
  constexpr std::size_t min_trees = 4;  // that two maps must have in common
  control_map control;
  control.input = {file, control_name, content_hash(file)};
  survey_map read = read_positions(control.input);
  if (!read.error.empty()) throw std::runtime_error("--control " + read.error);
  control.map = std::move(read.map);
  if (control.map.stems.size() < min_trees)
    throw file_error(file, "has " + std::to_string(control.map.stems.size()) + " trees",
                     "At least 4 that scans see are needed.");
  return control;
}

void require_no_control(const std::vector<survey_input>& inputs) {
  for (const survey_input& input : inputs)
    if (input.name == control_name)
      throw std::invalid_argument(input.path.string() +
                                  ": the trees of --control have this name in the results. Rename the scan.");
}

void add_control(survey_work& work, const control_map& control) {
  if (work.maps.empty()) return;
  work.control = work.maps.size();
  work.kept.push_back(control.input);
  work.names.push_back(control.input.name);
  work.maps.push_back(control.map);
}

void leave_out_unseen_control(survey& result, const survey_work& work) {
  if (!work.control) return;
  std::erase_if(result.trees, [&](const survey::tree& t) {
    return std::all_of(t.seen.begin(), t.seen.end(), [&](const auto& o) { return o.scan == *work.control; });
  });
  survey::scan& control = result.scans[*work.control];
  if (control.status == survey::status::placed) {
    if (!control.is_height_known)
      std::cerr << control_name
                << ": the heights of its trees are not known; those of the survey are those of "
                << "one of its scans\n";
    return;
  }
  if (control.component >= 0) {  // the last one, as that of the last map alone
    control.component = -1;
    --result.components;
    result.frames.pop_back();
  }
  std::cerr << control_name << ": none of its trees was recognised among those of the scans ("
            << to_string(control.status)
            << "); the frame is not that of the control. Does it hold most trees "
            << "around the scans, in metres, x to the east and y to the north?\n";
}

bool control_scale::differs() const {
  constexpr double deviations = 3, min_difference = 1e-4;
  return std::abs(factor - 1) > std::max(deviations * sigma, min_difference);
}

std::optional<control_scale> scale_of_control(const survey& result, const survey_work& work) {
  control_scale scale;
  double sum = 0, weights = 0, pairs = 0;
  for (const common_places& common : places_in_common(result, work)) {
    const auto fitted = detail::fit_scale(common.of_scan, common.of_control);
    if (!fitted) continue;
    const double weight = 1 / (fitted->sigma * fitted->sigma);
    sum += weight * (fitted->factor - 1);
    weights += weight;
    pairs += double(common.of_scan.size());
    ++scale.links;
  }
  if (scale.links == 0) return std::nullopt;
  scale.trees = trees_of_control(result, *work.control);
  scale.factor = 1 + sum / weights;
  scale.sigma = std::sqrt(std::max(1.0, pairs / double(scale.trees)) / weights);
  return scale;
}

nlohmann::ordered_json report_control(const survey& result, const survey_work& work) {
  if (!work.control) return nullptr;
  const std::optional<control_scale> scale = scale_of_control(result, work);
  if (!scale)
    return {{"scale", nullptr},
            {"sigma", nullptr},
            {"trees", trees_of_control(result, *work.control)},
            {"links", result.scans[*work.control].links}};
  if (scale->differs())
    std::cerr << control_name << ": distances in the control are " << describe(*scale)
              << " times those of the scans, as in a map projection; this scale is not applied\n";
  return {
      {"scale", scale->factor}, {"sigma", scale->sigma}, {"trees", scale->trees}, {"links", scale->links}};
}

}  // namespace globalmatch::support

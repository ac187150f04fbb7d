// `register_survey` and `refine_survey`, and what they return.
#include <globalmatch/survey.hpp>
#include <globalmatch/survey_refinement.hpp>

#include <algorithm>
#include <functional>
#include <memory>
#include <sstream>

#include "arrays.hpp"
#include "functions.hpp"
#include "options.hpp"
#include "results.hpp"

namespace globalmatch::python {

/// Rows of arrays.
struct tree_row {
  double x, y, z, radius, sigma, height_sigma;
  std::int32_t component;
  std::uint32_t scans;
};
struct observation_row {
  std::uint32_t tree, scan, stem, unused;
  double weight, height_weight;
};
struct target_row {
  std::uint32_t target, scan;
  double x, y, z, sigma, weight, height_weight, residual;
};

namespace {

using maps_given = std::vector<std::shared_ptr<const stem_map>>;

/// A survey, and what was found when its pairs were refined.
struct refined_survey : survey {
  std::vector<refined_pair> refined_pairs;
};

/// The maps: as they are, or made of positions.
maps_given read_maps(const py::object& maps) {
  if (!py::isinstance<py::sequence>(maps) || py::isinstance<py::array>(maps) || py::isinstance<py::str>(maps))
    throw py::type_error("maps: expected a list of stem maps or of positions of stems, got " +
                         py::cast<std::string>(py::str(py::type::of(maps))));
  maps_given result;
  for (const py::handle map : maps) {
    if (py::isinstance<stem_map>(map)) {
      result.push_back(py::cast<std::shared_ptr<stem_map>>(map));
    } else {
      columns stems(map, "maps[" + std::to_string(result.size()) + "]", false);
      result.push_back(stem_map_of(stems));
    }
  }
  return result;
}

refined_survey register_given(const py::object& maps, const py::dict& given) {
  const auto [running, options] = read_options<run_options, survey_options>(given);
  const maps_given all = read_maps(maps);
  std::vector<std::reference_wrapper<const stem_map>> each;
  for (const auto& map : all) each.push_back(*map);
  return run(running, [&, &options = options](const execution& exec) {
    return refined_survey{register_survey(each, options, exec), {}};
  });
}

refined_survey refine_given(const py::object& survey, const py::object& maps, const py::dict& given) {
  const auto& placed = argument_of_class<const refined_survey&>(survey, "survey", "a Survey");
  auto [running, options] = read_options<run_options, refinement_options>(given);
  const maps_given all = read_maps(maps);
  if (all.size() != placed.scans.size())
    throw py::value_error("maps: expected those of the survey, " + std::to_string(placed.scans.size()) +
                          ", got " + std::to_string(all.size()));
  for (std::size_t m = 0; m < all.size(); ++m)
    if (all[m]->ground_samples.empty() && all[m]->stem_samples.empty()) options.without_samples.push_back(m);
  return run(running, [&, &options = options](const execution& exec) {
    refined_survey result = placed;
    result.refined_pairs = refine_survey(
        result, [&](std::size_t scan) { return *all[scan]; }, options, exec);
    return result;
  });
}

bool is_placed(const survey::scan& scan) {
  return scan.status == survey::status::placed;
}

py::object pose_of(const survey::scan& scan) {
  if (scan.component < 0) return py::none();  // it is a guess
  return as_array(scan.survey_from_scan);
}

py::list alternatives_of(const survey::scan& scan) {
  py::list list;
  for (const Eigen::Isometry3d& pose : scan.alternatives) list.append(as_array(pose));
  return list;
}

std::string represent(const survey::scan& scan) {
  std::ostringstream text;
  text << "<SurveyScan: " << to_string(scan.status);
  if (is_placed(scan)) text << ", component " << scan.component << ", " << scan.links << " links";
  if (!scan.reason.empty()) text << ", " << scan.reason;
  return text.str() + ">";
}

std::string represent(const survey::link& link) {
  std::ostringstream text;
  text << "<SurveyLink: " << link.source << " to " << link.target << ", " << link.correspondences << " stems"
       << (link.used ? "" : ", not used") << ">";
  return text.str();
}

std::string represent(const refined_survey& s) {
  const auto placed = std::count_if(s.scans.begin(), s.scans.end(), is_placed);
  std::ostringstream text;
  if (s.cancelled) return "<Survey: cancelled>";
  text << "<Survey: " << placed << " of " << s.scans.size() << " scans placed, " << s.components
       << (s.components == 1 ? " component, " : " components, ") << s.trees.size() << " trees>";
  return text.str();
}

py::array trees_of(const refined_survey& s) {
  std::vector<tree_row> rows;
  for (const survey::tree& t : s.trees)
    rows.push_back({t.position.x(), t.position.y(), t.position.z(), t.radius, t.sigma, t.height_sigma,
                    t.component, std::uint32_t(t.seen.size())});
  return as_rows(rows);
}

py::array observations_of(const refined_survey& s) {
  std::vector<observation_row> rows;
  for (std::uint32_t tree = 0; tree < s.trees.size(); ++tree)
    for (const survey::observation& o : s.trees[tree].seen)
      rows.push_back({tree, std::uint32_t(o.scan), std::uint32_t(o.stem), 0, o.weight, o.height_weight});
  return as_rows(rows);
}

py::array target_observations_of(const refined_survey& s) {
  std::vector<target_row> rows;
  for (std::uint32_t target = 0; target < s.targets.size(); ++target)
    for (const survey::target_observation& o : s.targets[target].seen)
      rows.push_back({target, std::uint32_t(o.scan), o.position.x(), o.position.y(), o.position.z(), o.sigma,
                      o.weight, o.height_weight, o.residual});
  return as_rows(rows);
}

py::list targets_of(const refined_survey& s) {
  py::list list;
  for (const survey::target& t : s.targets) {
    py::dict row;
    row["name"] = t.name;
    row["position"] = as_array(t.position);
    row["sigma"] = t.sigma;
    row["height_sigma"] = t.height_sigma;
    row["component"] = t.component;
    list.append(row);
  }
  return list;
}

py::list priors_of(const refined_survey& s) {
  py::list list;
  for (const survey::adjusted_prior& p : s.priors) {
    py::dict row;
    row["scan"] = p.given.scan;
    row["weight"] = p.weight;
    row["yaw_weight"] = p.yaw_weight;
    row["height_weight"] = p.height_weight;
    list.append(row);
  }
  return list;
}

py::list frames_of(const refined_survey& s) {
  py::list list;
  for (const survey::frame& f : s.frames)
    list.append(py::make_tuple(as_str(to_string(f.source)), f.yaw_sigma));
  return list;
}

void add_scan(py::module_& module) {
  using scan = survey::scan;
  py::class_<scan>(module, "SurveyScan", "Where a scan of a survey stands.")
      .def_property_readonly("status", name_of(&scan::status))
      .def_readonly("reason", &scan::reason)
      .def_readonly("component", &scan::component)
      .def_property_readonly("survey_from_scan", &pose_of)
      .def_property_readonly("best_guess", [](const scan& s) { return as_array(s.survey_from_scan); })
      .def_readonly("uncertainty", &scan::uncertainty)
      .def_readonly("is_height_known", &scan::is_height_known)
      .def_readonly("links", &scan::links)
      .def_readonly("check_median", &scan::check_median)
      .def_readonly("check_worst", &scan::check_worst)
      .def_property_readonly("alternatives", &alternatives_of)
      .def_readonly("prior_deviations", &scan::prior_deviations)
      .def_readonly("fixed_distance", &scan::fixed_distance)
      .def("__repr__", [](const scan& s) { return represent(s); });
}

void add_link(py::module_& module) {
  using link = survey::link;
  py::class_<link>(module, "SurveyLink", "Two scans whose stems agree, or targets that both show.")
      .def_readonly("source", &link::source)
      .def_readonly("target", &link::target)
      .def_property_readonly("target_from_source",
                             [](const link& l) { return as_array(l.target_from_source); })
      .def_readonly("log10_nfa", &link::log10_nfa)
      .def_readonly("correspondences", &link::correspondences)
      .def_readonly("targets", &link::targets)
      .def_readonly("inlier_threshold", &link::inlier_threshold)
      .def_readonly("rms", &link::rms)
      .def_readonly("sigma_plan", &link::sigma_plan)
      .def_readonly("sigma_yaw", &link::sigma_yaw)
      .def_readonly("supporting_cycles", &link::supporting_cycles)
      .def_readonly("closure", &link::closure)
      .def_readonly("residual", &link::residual)
      .def_readonly("used", &link::used)
      .def("__repr__", [](const link& l) { return represent(l); });
}

void add_pair(py::module_& module) {
  using pair = refined_pair;
  py::class_<pair>(module, "RefinedPair", "What the samples of two scans say of the transform between them.")
      .def_property_readonly("source", [](const pair& p) { return p.start.source; })
      .def_property_readonly("target", [](const pair& p) { return p.start.target; })
      .def_property_readonly("target_from_source",
                             [](const pair& p) { return as_array(p.target_from_source); })
      .def_readonly("uncertainty", &pair::uncertainty)
      .def_readonly("is_refined", &pair::is_refined)
      .def_readonly("is_height_refined", &pair::is_height_refined)
      .def_readonly("tilt_sigma", &pair::tilt_sigma)
      .def_readonly("samples", &pair::samples)
      .def_readonly("rms", &pair::rms)
      .def_readonly("reason", &pair::reason)
      .def("__repr__", [](const py::object& self) {
        return represent_by(self, {"source", "target", "is_refined", "is_height_refined", "samples", "rms"});
      });
}

void add_survey(py::module_& module) {
  py::class_<refined_survey>(module, "Survey", "Where the scans of a survey stand, and their trees.")
      .def_property_readonly("scans", [](const refined_survey& s) { return s.scans; })
      .def_property_readonly("links", [](const refined_survey& s) { return s.links; })
      .def_property_readonly("trees", &trees_of)
      .def_property_readonly("observations", &observations_of)
      .def_property_readonly("targets", &targets_of)
      .def_property_readonly("target_observations", &target_observations_of)
      .def_property_readonly("priors", &priors_of)
      .def_property_readonly("frames", &frames_of)
      .def_property_readonly("stem_sigma", [](const refined_survey& s) { return s.stem_sigma; })
      .def_property_readonly("components", [](const refined_survey& s) { return s.components; })
      .def_property_readonly("candidates", [](const refined_survey& s) { return s.candidates; })
      .def_property_readonly("cancelled", [](const refined_survey& s) { return s.cancelled; })
      .def_readonly("refined_pairs", &refined_survey::refined_pairs)
      .def("__repr__", [](const refined_survey& s) { return represent(s); });
}

}  // namespace

void add_surveys(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(tree_row, x, y, z, radius, sigma, height_sigma, component, scans);
  PYBIND11_NUMPY_DTYPE(observation_row, tree, scan, stem, weight, height_weight);
  PYBIND11_NUMPY_DTYPE(target_row, target, scan, x, y, z, sigma, weight, height_weight, residual);
  add_scan(module);
  add_link(module);
  add_pair(module);
  add_survey(module);
  define(module, "register_survey", argument_names<1>{"maps"}, &register_given,
         document<run_options, survey_options>(
             module, "register_survey",
             "Registers any number of stem maps, or of positions as in match_stems, into one frame."));
  define(module, "refine_survey", argument_names<2>{"survey", "maps"}, &refine_given,
         document<run_options, refinement_options>(
             module, "refine_survey", "The survey adjusted to the ground and stem samples of its maps."));
}

}  // namespace globalmatch::python

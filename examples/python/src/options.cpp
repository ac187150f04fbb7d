#include "options.hpp"

namespace globalmatch::python {

std::string document(py::module_& module, const char* function, const std::string& text,
                     const py::dict& defaults) {
  if (!py::hasattr(module, "defaults")) module.attr("defaults") = py::dict();
  module.attr("defaults")[function] = defaults;
  std::string result = text + "\n\nKeyword arguments and their defaults:\n";
  for (const auto& [name, value] : defaults)
    result +=
        "    " + py::cast<std::string>(py::str(name)) + " = " + py::cast<std::string>(py::repr(value)) + "\n";
  return result;
}

template <class E>
using named = std::pair<std::string_view, E>;

template <>
struct enumerators<ground_filter> {
  static constexpr named<ground_filter> all[] = {{"planes", ground_filter::planes},
                                                 {"cloth", ground_filter::cloth},
                                                 {"normalized", ground_filter::normalized}};
};
template <>
struct enumerators<stem_point_rule> {
  static constexpr named<stem_point_rule> all[] = {{"cells", stem_point_rule::cells},
                                                   {"points", stem_point_rule::points}};
};
template <>
struct enumerators<vertical_rule> {
  static constexpr named<vertical_rule> all[] = {{"given", vertical_rule::given},
                                                 {"stems_if_tilted", vertical_rule::stems_if_tilted},
                                                 {"stems", vertical_rule::stems}};
};
template <>
struct enumerators<proposal> {
  static constexpr named<proposal> all[] = {{"triangle_index", proposal::triangle_index},
                                            {"algorithm_1", proposal::algorithm_1}};
};
template <>
struct enumerators<icp_metric> {
  static constexpr named<icp_metric> all[] = {{"none", icp_metric::none},
                                              {"point_to_point", icp_metric::point_to_point},
                                              {"point_to_plane", icp_metric::point_to_plane}};
};
template <>
struct enumerators<degrees_of_freedom> {
  static constexpr std::pair<int, degrees_of_freedom> all[] = {{4, degrees_of_freedom::four},
                                                               {6, degrees_of_freedom::six}};
};

static void read_fields(keywords& from, cloth_options& o) {
  from.read("rigidness", o.rigidness)
      .read("time_step", o.time_step)
      .read("gravity", o.gravity)
      .read("max_iterations", o.max_iterations)
      .read("convergence_threshold", o.convergence_threshold)
      .read("slope_step", o.slope_step);
}

static void read_fields(keywords& from, ground_options& o) {
  from.read("filter", o.filter)
      .read("resolution", o.resolution)
      .group("cloth", o.cloth)
      .read("low_point_depth", o.low_point_depth)
      .read("max_slope", o.max_slope)
      .read("ground_band", o.ground_band)
      .read("hole_radius", o.hole_radius);
}

static void read_fields(keywords& from, understory_options& o) {
  from.read("min_height", o.min_height).read("max_height", o.max_height);
}

static void read_fields(keywords& from, verticality_options& o) {
  from.read("constraint", o.constraint)
      .read("threshold", o.threshold)
      .read("radius", o.radius)
      .read("min_neighbors", o.min_neighbors)
      .read("max_radius", o.max_radius);
}

static void read_fields(keywords& from, cylinder_options& o) {
  from.read("min_radius", o.min_radius)
      .read("max_radius", o.max_radius)
      .read("max_tilt_deg", o.max_tilt_deg)
      .read("distance_tolerance", o.distance_tolerance)
      .read("usual_taper", o.usual_taper)
      .read("taper_weight", o.taper_weight)
      .read("max_iterations", o.max_iterations)
      .read("seed", o.seed);
}

static void read_fields(keywords& from, stem_cylinder_options& o) {
  from.group("cylinder", o.cylinder)
      .read("column_width", o.column_width)
      .read("min_points", o.min_points)
      .read("min_height", o.min_height)
      .read("min_filled", o.min_filled)
      .read("min_share", o.min_share)
      .read("max_inside", o.max_inside)
      .read("max_sigma", o.max_sigma);
}

static void read_fields(keywords& from, triangle_options& o) {
  from.read("neighbors", o.neighbors);
}

static void read_fields(keywords& from, global_matching_options& o) {
  from.read("max_hypotheses", o.max_hypotheses)
      .read("max_seeds", o.max_seeds)
      .read("sufficient", o.sufficient);
}

static void read_fields(keywords& from, decision_options& o) {
  from.read("min_correspondences", o.min_correspondences)
      .read("min_minor_axis_sigma", o.min_minor_axis_sigma)
      .read("max_nfa", o.max_nfa)
      .read("comparisons", o.comparisons)
      .read("alternative_share", o.alternative_share);
}

bool ask(const py::object& callback, const progress& at) {
  if (callback.is_none()) return true;
  const py::object answer = callback(at.fraction, py::str(at.stage.data(), at.stage.size()));
  if (answer.is_none()) return true;
  const int truth = PyObject_IsTrue(answer.ptr());
  if (truth < 0) throw py::error_already_set();
  return truth != 0;
}

void read_fields(keywords& from, run_options& o) {
  from.read("threads", o.threads).read("progress", o.progress);
  if (o.threads < 0)
    throw py::value_error("threads: expected 0 (all) or more, got " + std::to_string(o.threads));
}

void read_fields(keywords& from, frame_options& o) {
  from.read("up", o.up);
}

void read_fields(keywords& from, mapping_options& o) {
  from.group("ground", o.ground)
      .group("understory", o.understory)
      .read("rule", o.rule)
      .read("voxel_size", o.voxel_size)
      .group("verticality", o.verticality)
      .read("link_distance", o.link_distance)
      .group("stems", o.stems)
      .read("min_quality", o.min_quality)
      .read("vertical", o.vertical)
      .read("scanner", o.scanner)
      .read("seed", o.stems.cylinder.seed);
}

/// The prior, whose three fields are arguments of their own.
static void read_prior(keywords& from, std::optional<transform_prior>& prior) {
  std::optional<Eigen::Isometry3d> transform;
  transform_prior given;
  from.read("prior", transform)
      .read("prior_sigma_position", given.sigma_position)
      .read("prior_sigma_yaw", given.sigma_yaw);
  for (const char* sigma : {"prior_sigma_position", "prior_sigma_yaw"})
    if (!transform && from.has(sigma)) throw py::value_error(std::string(sigma) + ": it needs a prior");
  if (!transform) return;
  given.target_from_source = *transform;
  prior = given;
}

void read_fields(keywords& from, matching_options& o) {
  from.read("dof", o.dof)
      .read("horizontal", o.horizontal)
      .read("scale", o.scale)
      .read("inlier_threshold", o.inlier_threshold);
  if (from.has("tolerance") && from.has("inlier_threshold"))
    throw py::value_error("tolerance: it is the inlier_threshold, which is given as well");
  from.read("tolerance", o.inlier_threshold);  // the name that the programs have for it
  read_prior(from, o.prior);
  from.read("proposal", o.proposal)
      .group("triangles", o.triangles)
      .group("global_matching", o.global)
      .group("decision", o.decision);
}

void read_fields(keywords& from, icp_options& o) {
  from.read("metric", o.metric)
      .read("max_distance", o.max_distance)
      .read("trimming", o.trimming)
      .read("max_iterations", o.max_iterations)
      .read("convergence_threshold", o.convergence_threshold)
      .read("max_points", o.max_points)
      .read("plane_neighbors", o.plane_neighbors);
}

static void read_fields(keywords& from, survey_options::fixed_scan& o) {
  from.require("scan", o.scan).require("survey_from_scan", o.survey_from_scan);
}

static void read_fields(keywords& from, survey_options::prior& o) {
  from.require("scan", o.scan)
      .read("position", o.position)
      .read("yaw", o.yaw)
      .read("sigma_plan", o.sigma_plan)
      .read("sigma_height", o.sigma_height)
      .read("sigma_yaw", o.sigma_yaw);
}

static void read_fields(keywords& from, survey_options::level& o) {
  from.require("scan", o.scan).read("sigma", o.sigma);
}

static void read_fields(keywords& from, survey_options::target& o) {
  from.require("scan", o.scan).require("name", o.name).require("position", o.position).read("sigma", o.sigma);
}

void read_fields(keywords& from, survey_options& o) {
  from.read("max_nfa", o.max_nfa)
      .read("reference", o.reference)
      .list("fixed", o.fixed)
      .list("priors", o.priors)
      .list("levels", o.levels)
      .list("targets", o.targets);
}

void read_fields(keywords& from, refinement_options& o) {
  from.group("icp", o.icp, "metric").read("pairs_per_scan", o.pairs_per_scan);
}

}  // namespace globalmatch::python

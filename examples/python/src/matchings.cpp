// `match_stems`, and what it returns.
#include <globalmatch/stem_matching.hpp>

#include <sstream>

#include "arrays.hpp"
#include "functions.hpp"
#include "options.hpp"
#include "results.hpp"

namespace globalmatch::python {

namespace {

matching match_given(const py::object& source, const py::object& target, const py::dict& given) {
  const auto [running, frame, options] = read_options<run_options, frame_options, matching_options>(given);
  columns source_columns(source, "source", false), target_columns(target, "target", false);
  const any_stem_range from = stem_positions(source_columns), to = stem_positions(target_columns);
  return run(running, [&, &options = options, &up = frame.up](const execution& exec) {
    return std::visit([&](const auto& s, const auto& t) { return match_stems(s, t, options, up, exec); },
                      from, to);
  });
}

py::array correspondences_of(const hypothesis& h) {
  const auto count = static_cast<py::ssize_t>(h.correspondences.size());
  py::array_t<stem_index> pairs({count, py::ssize_t(2)});
  stem_index* to = pairs.mutable_data();
  for (const correspondence& c : h.correspondences) {
    *to++ = c.source;
    *to++ = c.target;
  }
  return pairs;
}

Eigen::Vector3d as_place(const std::array<double, 3>& place) {
  return {place[0], place[1], place[2]};
}

/// Degrees of freedom of the transform; None where there is none.
py::object dof_of(const matching& m) {
  if (!m.vertical) return py::none();
  return py::cast(m.vertical->kind == vertical_kind::rotated ? 6 : 4);
}

std::string represent(const hypothesis& h) {
  std::ostringstream text;
  text << "<Hypothesis: " << h.correspondences.size() << " pairs, log10 NFA " << h.log10_nfa << ">";
  return text.str();
}

std::string represent(const transform_uncertainty& u) {
  std::ostringstream text;
  text << "<Uncertainty: " << u.covariance.rows() << " degrees of freedom, expected error "
       << u.expected_error(u.center) << " m at the center>";
  return text.str();
}

std::string represent(const vertical_fit& v) {
  std::ostringstream text;
  text << "<Vertical: " << to_string(v.kind) << ", height by " << to_string(v.source);
  if (v.is_known()) text << ", sigma " << v.sigma << " m";
  return text.str() + ">";
}

}  // namespace

std::string represent(const matching& m) {
  std::ostringstream text;
  text << "<Matching: " << to_string(m.outcome);
  if (m.target_from_source)
    text << ", " << m.funnel.correspondences << " of " << m.funnel.source_stems << " and "
         << m.funnel.target_stems << " stems, probability " << m.probability;
  else
    text << ", " << m.reason;
  return text.str() + ">";
}

namespace {

void add_evidence(py::module_& module) {
  py::class_<hypothesis>(module, "Hypothesis",
                         "A transform that may be the right one, and the evidence for it.")
      .def_property_readonly("correspondences", &correspondences_of)
      .def_property_readonly("target_from_source",
                             [](const hypothesis& h) { return as_array(h.target_from_source); })
      .def_readonly("inlier_threshold", &hypothesis::inlier_threshold)
      .def_readonly("log10_nfa", &hypothesis::log10_nfa)
      .def_readonly("log10_nfa_poisson", &hypothesis::log10_nfa_poisson)
      .def_property_readonly("evidence", name_of(&hypothesis::evidence))
      .def_readonly("rms", &hypothesis::rms)
      .def_readonly("consensus", &hypothesis::consensus)
      .def("__repr__", [](const hypothesis& h) { return represent(h); });
  using uncertainty = transform_uncertainty;
  py::class_<uncertainty>(module, "Uncertainty", "Of shift and turn about the center, frame of the target.")
      .def_property_readonly("center", array_of(&uncertainty::center))
      .def_property_readonly("up", array_of(&uncertainty::up))
      .def_property_readonly("covariance", array_of(&uncertainty::covariance))
      .def(
          "at",
          [](const uncertainty& u, const std::array<double, 3>& p) { return as_array(u.at(as_place(p))); },
          py::arg("place"), "Covariance [m^2], 3 x 3, of where the transform places what belongs there.")
      .def(
          "expected_error",
          [](const uncertainty& u, const std::array<double, 3>& p) { return u.expected_error(as_place(p)); },
          py::arg("place"), "Root mean square distance [m] from where it belongs.")
      .def("__repr__", [](const uncertainty& u) { return represent(u); });
}

void add_parts(py::module_& module) {
  py::class_<vertical_fit>(module, "Vertical", "The height of a transform.")
      .def_property_readonly("kind", name_of(&vertical_fit::kind))
      .def_property_readonly("source", name_of(&vertical_fit::source))
      .def_property_readonly("is_known", &vertical_fit::is_known)
      .def_readonly("sigma", &vertical_fit::sigma)
      .def_readonly("tilt", &vertical_fit::tilt)
      .def_readonly("reason", &vertical_fit::reason)
      .def("__repr__", [](const vertical_fit& v) { return represent(v); });
  py::class_<planting_lattice>(module, "Lattice",
                               "The shortest shifts at which stems of a plantation repeat.")
      .def_property_readonly("first", array_of(&planting_lattice::first))
      .def_property_readonly("second", array_of(&planting_lattice::second))
      .def_property_readonly("direction", &planting_lattice::direction)
      .def_property_readonly("angle", &planting_lattice::angle)
      .def("__repr__", [](const py::object& self) {
        return represent_by(self, {"first", "second"});
      });
  py::class_<scale_estimate>(module, "Scale", "By how much distances in the target are longer.")
      .def_readonly("factor", &scale_estimate::factor)
      .def_readonly("sigma", &scale_estimate::sigma)
      .def_readonly("differs", &scale_estimate::differs)
      .def_readonly("is_applied", &scale_estimate::is_applied)
      .def("__repr__", [](const py::object& self) {
        return represent_by(self, {"factor", "sigma", "differs", "is_applied"});
      });
  py::class_<prior_deviation>(module, "PriorDeviation", "How a transform differs from that of the prior.")
      .def_readonly("distance", &prior_deviation::distance)
      .def_readonly("turn", &prior_deviation::turn)
      .def_readonly("sigmas", &prior_deviation::sigmas)
      .def_readonly("is_contradicted", &prior_deviation::is_contradicted)
      .def("__repr__", [](const py::object& self) {
        return represent_by(self, {"distance", "turn", "sigmas", "is_contradicted"});
      });
}

}  // namespace

void add_matchings(py::module_& module) {
  add_evidence(module);
  add_parts(module);
  py::class_<matching>(module, "Matching", "What came of matching, with the evidence to trust or reject it.")
      .def_property_readonly("outcome", name_of(&matching::outcome))
      .def_readonly("reason", &matching::reason)
      .def_property_readonly("target_from_source",
                             [](const matching& m) { return as_array(m.target_from_source); })
      .def_readonly("probability", &matching::probability)
      .def_readonly("hypotheses", &matching::hypotheses)
      .def_readonly("uncertainty", &matching::uncertainty)
      .def_readonly("lattice", &matching::lattice)
      .def_readonly("vertical", &matching::vertical)
      .def_readonly("scale", &matching::scale)
      .def_readonly("prior", &matching::prior)
      .def_property_readonly("dof", &dof_of)
      .def_readonly("inlier_threshold", &matching::inlier_threshold)
      .def_property_readonly("funnel", [](const matching& m) { return describe(explain(m.funnel)); })
      .def_property_readonly("warnings", [](const matching& m) { return describe(support::warnings_of(m)); })
      .def("__repr__", [](const matching& m) { return represent(m); });
  define(
      module, "match_stems", argument_names<2>{"source", "target"}, &match_given,
      document<run_options, frame_options, matching_options>(
          module, "match_stems",
          "Matches two sets of stem positions: N x 2 or N x 3 arrays, or columns x, y and, where known, z, "
          "radius, position_sigma, height_sigma, axis_x, axis_y, axis_z."));
}

}  // namespace globalmatch::python

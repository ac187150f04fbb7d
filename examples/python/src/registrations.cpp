// `register_maps` and `register_scans`, and what they return.
#include <globalmatch/registration.hpp>

#include <memory>

#include "arrays.hpp"
#include "functions.hpp"
#include "options.hpp"
#include "results.hpp"

namespace globalmatch::python {

namespace {

/// A registration with its maps.
struct mapped_registration : registration {
  std::shared_ptr<stem_map> source, target;
};

registration_options options_of(const mapping_options& mapping, const matching_options& matching,
                                const registration_icp& fine) {
  return {mapping, matching, fine.icp};
}

mapped_registration register_given_scans(const py::object& source, const py::object& target,
                                         const py::dict& given) {
  const auto [running, frame, mapping, matching, fine] =
      read_options<run_options, frame_options, mapping_options, matching_options, registration_icp>(given);
  const columns read_source(source, "source", true), read_target(target, "target", true);
  const auto from = scan_points(read_source), to = scan_points(read_target);
  const registration_options options = options_of(mapping, matching, fine);
  return run(running, [&, &up = frame.up](const execution& exec) {
    scan_registration result = register_scans(from, to, options, up, exec);
    return mapped_registration{std::move(result.registration),
                               std::make_shared<stem_map>(std::move(result.source)),
                               std::make_shared<stem_map>(std::move(result.target))};
  });
}

mapped_registration register_given_maps(const py::object& given_source, const py::object& given_target,
                                        const py::dict& given) {
  using shared_map = std::shared_ptr<stem_map>;
  const char* const expected = "a StemMap, as map_stems returns";
  const auto source = argument_of_class<shared_map>(given_source, "source", expected),
             target = argument_of_class<shared_map>(given_target, "target", expected);
  const auto [running, matching, fine] = read_options<run_options, matching_options, registration_icp>(given);
  const registration_options options = options_of({}, matching, fine);
  return run(running, [&](const execution& exec) {
    return mapped_registration{register_maps(*source, *target, options, exec), source, target};
  });
}

std::string represent(const mapped_registration& r) {
  if (!r.target_from_source)
    return "<Registration: " + std::string(to_string(r.outcome)) + ", " + r.reason + ">";
  std::string text = python::represent(r.matching);
  text.replace(0, std::string("<Matching").size(), "<Registration");
  if (r.refined) text.insert(text.size() - 1, ", refined by ICP");
  return text;
}

/// Warnings of both maps, their names before the texts, and of the matching.
py::list warnings_of_all(const mapped_registration& r) {
  std::vector<support::warning> warnings;
  const std::pair<const char*, const stem_map*> maps[] = {{"source", r.source.get()},
                                                          {"target", r.target.get()}};
  for (const auto& [name, map] : maps)
    for (const support::warning& w : all_warnings_of(*map))
      warnings.push_back({w.code, std::string(name) + ": " + w.text});
  for (const support::warning& w : support::warnings_of(r.matching)) warnings.push_back(w);
  return describe(warnings);
}

/// A property that is that of the matching.
template <class Member>
auto of_matching(Member matching::*member) {
  return [member](const mapped_registration& r) { return r.matching.*member; };
}

}  // namespace

void add_registrations(py::module_& module) {
  py::class_<icp_result>(module, "IcpResult", "What came of the fine registration.")
      .def_property_readonly("target_from_source",
                             [](const icp_result& r) { return as_array(r.target_from_source); })
      .def_readonly("converged", &icp_result::converged)
      .def_readonly("iterations", &icp_result::iterations)
      .def_readonly("pairs", &icp_result::pairs)
      .def_readonly("rms", &icp_result::rms)
      .def("__repr__", [](const py::object& self) {
        return represent_by(self, {"converged", "iterations", "pairs", "rms"});
      });
  using result = mapped_registration;
  py::class_<result>(module, "Registration",
                     "What came of a registration, with the evidence to trust or reject it.")
      .def_property_readonly("outcome", [](const result& r) { return as_str(to_string(r.outcome)); })
      .def_property_readonly("reason", [](const result& r) { return r.reason; })
      .def_property_readonly("target_from_source",
                             [](const result& r) { return as_array(r.target_from_source); })
      .def_property_readonly("matching", [](const result& r) -> const matching& { return r.matching; })
      .def_property_readonly("icp", [](const result& r) { return r.icp; })
      .def_property_readonly("refined", [](const result& r) { return r.refined; })
      .def_property_readonly("source", [](const result& r) { return r.source; })
      .def_property_readonly("target", [](const result& r) { return r.target; })
      .def_property_readonly("probability", of_matching(&matching::probability))
      .def_property_readonly("uncertainty", of_matching(&matching::uncertainty))
      .def_property_readonly("hypotheses", of_matching(&matching::hypotheses))
      .def_property_readonly("vertical", of_matching(&matching::vertical))
      .def_property_readonly("warnings", &warnings_of_all)
      .def("__repr__", [](const result& r) { return represent(r); });
  define(module, "register_scans", argument_names<2>{"source", "target"}, &register_given_scans,
         document<run_options, frame_options, mapping_options, matching_options, registration_icp>(
             module, "register_scans",
             "Registers two scans, N x 3 coordinates in metres: maps their stems, matches them, refines by "
             "ICP."));
  define(module, "register_maps", argument_names<2>{"source", "target"}, &register_given_maps,
         document<run_options, matching_options, registration_icp>(
             module, "register_maps", "Registers two mapped scans, as register_scans does."));
}

}  // namespace globalmatch::python

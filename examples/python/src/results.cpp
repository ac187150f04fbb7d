#include "results.hpp"

namespace globalmatch::python {

py::list describe(const std::vector<funnel_step>& steps) {
  py::list table;
  for (const funnel_step& s : steps) {
    py::dict row;
    row["step"] = as_str(s.step);
    row["input"] = as_str(s.of);
    row["input_count"] = s.in;
    row["output"] = as_str(s.what);
    row["output_count"] = s.out;
    row["dropped_because"] = as_str(s.rest);
    row["remedy"] = as_str(s.remedy);
    table.append(row);
  }
  return table;
}

py::list describe(const std::vector<support::warning>& warnings) {
  py::list list;
  for (const support::warning& w : warnings) list.append(py::make_tuple(w.code, w.text));
  return list;
}

std::string represent_by(const py::object& self, std::initializer_list<const char*> properties) {
  std::string text = "<" + py::cast<std::string>(py::type::of(self).attr("__name__"));
  const char* before = ": ";
  for (const char* property : properties) {
    text += before + std::string(property) + " " + py::cast<std::string>(py::repr(self.attr(property)));
    before = ", ";
  }
  return text + ">";
}

std::vector<support::warning> all_warnings_of(const stem_map& map) {
  if (map.cancelled) return {};
  std::vector<support::warning> warnings = support::warnings_of(map);
  if (is_tilted(map)) warnings.push_back({"tilted", "its stems " + describe_tilt(map)});
  return warnings;
}

}  // namespace globalmatch::python

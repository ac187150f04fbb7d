// `map_stems`, and what it returns.
#include <globalmatch/stem_map_io.hpp>
#include <globalmatch/stem_mapping.hpp>

#include <fstream>
#include <memory>
#include <sstream>

#include "arrays.hpp"
#include "functions.hpp"
#include "options.hpp"
#include "results.hpp"
#include "support/atomic_file.hpp"
#include "support/file_error.hpp"

namespace globalmatch::python {

/// A stem as a row of an array.
struct stem_row {
  double x, y, z, radius, radius_sigma, taper, position_sigma, height_sigma, quality, axis_x, axis_y, axis_z;
  std::uint32_t ground_points, points;
  bool ground_seen;
  std::uint8_t unused[7] = {};  // all bytes of the array are those of the map
};

namespace {

std::shared_ptr<stem_map> map_scan(const py::object& scan, const py::dict& given) {
  const auto [running, frame, options] = read_options<run_options, frame_options, mapping_options>(given);
  const columns read(scan, "scan", true);
  const auto points = scan_points(read);
  return run(running, [&, &options = options, &up = frame.up](const execution& exec) {
    return std::make_shared<stem_map>(map_stems(points, options, up, exec));
  });
}

py::array stems_of(const stem_map& map) {
  std::vector<stem_row> rows;
  for (const stem& s : map.stems)
    rows.push_back({s.position.x(), s.position.y(), s.position.z(), s.radius, s.radius_sigma, s.taper,
                    s.position_sigma, s.height_sigma, s.quality, s.axis.x(), s.axis.y(), s.axis.z(),
                    s.ground_points, std::uint32_t(s.support.size()), s.ground_seen});
  return as_rows(rows);
}

std::string represent(const stem_map& map) {
  std::ostringstream text;
  if (map.cancelled) return "<StemMap: cancelled>";
  text << "<StemMap: " << map.stems.size() << " stems";
  if (map.funnel.ground.points > 0) text << " in " << map.funnel.ground.points << " points";
  text << ", ground " << to_string(map.terrain.status) << ">";
  return text.str();
}

std::string bytes_of(const stem_map& map) {
  std::ostringstream out(std::ios::binary);
  write_stem_map(out, map);
  return std::move(out).str();
}

std::shared_ptr<stem_map> map_of(const std::string& bytes) {
  std::istringstream in(bytes, std::ios::binary);
  return std::make_shared<stem_map>(read_stem_map(in).map);
}

[[noreturn]] void refuse_file(const py::object& path) {
  PyErr_SetFromErrnoWithFilenameObject(PyExc_OSError, path.ptr());
  throw py::error_already_set();
}

std::string text_of_path(const py::object& path) {
  return py::cast<std::string>(py::module_::import("os").attr("fspath")(path));
}

void write_file(const py::object& path, const py::object& given, const py::dict& options) {
  read_options<>(options);
  const auto& map = argument_of_class<const stem_map&>(given, "map", "a StemMap");
  if (map.cancelled) throw py::value_error("map: it was cancelled, and is not whole");
  try {
    support::atomic_file file(text_of_path(path));
    file.stream() << bytes_of(map);
    file.commit();
  } catch (const support::file_error& error) {  // it names the path
    PyErr_SetString(PyExc_OSError, error.what());
    throw py::error_already_set();
  }
}

std::shared_ptr<stem_map> read_file(const py::object& path, const py::dict& options) {
  read_options<>(options);
  std::ifstream in(text_of_path(path), std::ios::binary);
  if (!in) refuse_file(path);
  return std::make_shared<stem_map>(read_stem_map(in).map);
}

py::object upright_of(const stem_map& map) {
  if (!map.upright) return py::none();
  return py::make_tuple(as_array(map.upright->up), map.upright->sigma);
}

template <class T>
auto view(std::vector<T> stem_map::*member) {
  return [member](py::object self) { return view_of(py::cast<const stem_map&>(self).*member, self); };
}

py::array points_on_stem(py::object self, std::size_t number) {
  const stem_map& map = py::cast<const stem_map&>(self);
  if (number >= map.stems.size()) throw py::index_error("there is no stem of that number");
  return view_of(map.stems[number].support, self);
}

void add_class(py::module_& module) {
  py::class_<stem_map, std::shared_ptr<stem_map>>(module, "StemMap",
                                                  "What is known of a scan once its stems are mapped.")
      .def_property_readonly("stems", &stems_of)
      .def_property_readonly("up", array_of(&stem_map::up))
      .def_property_readonly("given_up", array_of(&stem_map::given_up))
      .def_readonly("up_by_stems", &stem_map::up_by_stems)
      .def_property_readonly("upright", &upright_of)
      .def_property_readonly("is_tilted", [](const stem_map& map) { return is_tilted(map); })
      .def_property_readonly("ground",
                             [](const stem_map& map) { return as_str(to_string(map.terrain.status)); })
      .def_property_readonly("cut_off", [](const stem_map& map) { return map.terrain.cut_off; })
      .def_property_readonly("seen_from_scanner", [](const stem_map& map) { return !map.visible.empty(); })
      .def_readonly("spacing_near", &stem_map::spacing_near)
      .def_readonly("spacing_far", &stem_map::spacing_far)
      .def_readonly("distance_tolerance", &stem_map::distance_tolerance)
      .def_property_readonly("ground_samples", view(&stem_map::ground_samples))
      .def_property_readonly("stem_samples", view(&stem_map::stem_samples))
      .def_property_readonly("stem_normals", view(&stem_map::stem_normals))
      .def("points_on_stem", &points_on_stem, py::arg("number"))
      .def_property_readonly("points", [](const stem_map& map) { return map.funnel.ground.points; })
      .def_property_readonly("not_finite", [](const stem_map& map) { return map.funnel.ground.not_finite; })
      .def_property_readonly("funnel", [](const stem_map& map) { return describe(explain(map.funnel)); })
      .def_property_readonly("warnings", [](const stem_map& map) { return describe(all_warnings_of(map)); })
      .def_readonly("cancelled", &stem_map::cancelled)
      .def("__repr__", &represent)
      .def("__len__", [](const stem_map& map) { return map.stems.size(); })
      .def(py::pickle([](const stem_map& map) { return py::bytes(bytes_of(map)); },
                      [](const py::bytes& bytes) { return map_of(bytes); }));
}

}  // namespace

void add_stem_maps(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(stem_row, x, y, z, radius, radius_sigma, taper, position_sigma, height_sigma, quality,
                       axis_x, axis_y, axis_z, ground_points, points, ground_seen);
  add_class(module);
  define(module, "map_stems", argument_names<1>{"scan"}, &map_scan,
         document<run_options, frame_options, mapping_options>(
             module, "map_stems", "Maps the stems of a scan, N x 3 coordinates in metres."));
  define(module, "write_stem_map", argument_names<2>{"path", "map"}, &write_file,
         "Writes a stem map file (docs/stem_map_file.md), with samples: whole, or not at all.");
  define(module, "read_stem_map", argument_names<1>{"path"}, &read_file, "Reads a stem map file.");
}

}  // namespace globalmatch::python

#include "arrays.hpp"

#include <globalmatch/stem_map.hpp>

#include <algorithm>
#include <cctype>
#include <utility>

namespace globalmatch::python {

namespace {

constexpr double no_number = 0;  // what columns that are missing refer to

/// Throws for an array with a mask, which would be lost; `name` is that of the argument or column.
py::object as_array(py::handle given, const std::string& name) {
  const py::module_ numpy = py::module_::import("numpy");
  if (!py::isinstance(given, numpy.attr("ma").attr("MaskedArray"))) return numpy.attr("asarray")(given);
  const bool is_matrix = py::cast<int>(given.attr("ndim")) == 2;
  throw py::type_error(name + ": expected an array without a mask; " +
                       (is_matrix ? "numpy.ma.compress_rows(...)" : ".compressed()") +
                       " leaves out what is masked, .filled(numpy.nan) lets a scan skip it");
}

/// Throws where the name of a file is given in place of what is in it.
void refuse_path(py::handle given, const std::string& name) {
  if (py::isinstance<py::str>(given) || py::isinstance<py::bytes>(given) || py::hasattr(given, "__fspath__"))
    throw py::type_error(name +
                         ": expected an array, got the name of a file; laspy.read(path).xyz reads LAS " +
                         "and LAZ, plyfile.PlyData.read(path)[\"vertex\"].data reads PLY");
}

std::string text_of(const py::object& value) {
  return py::cast<std::string>(py::str(value));
}

std::string upper_case(std::string name) {
  for (char& c : name) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return name;
}

column missing() {
  return {reinterpret_cast<const std::byte*>(&no_number), 0, false};
}

}  // namespace

columns::columns(py::handle given, std::string name, bool needs_heights) : name_(std::move(name)) {
  refuse_path(given, name_);
  table_ = py::none();
  if (py::isinstance<py::dict>(given)) {
    table_ = py::reinterpret_borrow<py::object>(given);
    names_ = py::list(given.attr("keys")());
  } else if (py::hasattr(given, "columns") && py::hasattr(given, "__getitem__")) {
    table_ = py::reinterpret_borrow<py::object>(given);
    names_ = py::list(given.attr("columns"));
  } else {
    const py::object array = as_array(given, name_);
    if (array.attr("dtype").attr("names").is_none()) {
      read_matrix(array, needs_heights);
      return;
    }
    table_ = array;
    names_ = py::list(array.attr("dtype").attr("names"));
  }
  read_coordinates(needs_heights);
}

void columns::read_matrix(const py::array& matrix, bool needs_heights) {
  const char* const wanted = needs_heights ? "an N x 3 array" : "an N x 2 or N x 3 array";
  const bool fits = matrix.ndim() == 2 && (matrix.shape(1) == 3 || (!needs_heights && matrix.shape(1) == 2));
  if (!fits && matrix.dtype().kind() == 'O')
    throw py::type_error(name_ + ": expected " + wanted +
                         ", a structured array or a table with columns x, y" + (needs_heights ? ", z" : "") +
                         "; got objects");
  if (!fits)
    throw py::value_error(name_ + ": expected " + wanted + ", got shape " + text_of(matrix.attr("shape")));
  const column first = require_numbers(matrix, "");
  size_ = static_cast<std::size_t>(matrix.shape(0));
  has_heights_ = matrix.shape(1) == 3;
  coordinates_.fill(missing());
  for (std::ptrdiff_t k = 0; k < matrix.shape(1); ++k)
    coordinates_[std::size_t(k)] = {first.first + k * matrix.strides(1), matrix.strides(0), first.is_single};
}

void columns::read_coordinates(bool needs_heights) {
  const auto coordinate = [this](const std::string& axis) {
    return find(has_name(axis) ? axis : upper_case(axis));
  };
  const std::optional<column> x = coordinate("x"), y = coordinate("y"), z = coordinate("z");
  if (!x || !y || (needs_heights && !z))
    throw py::value_error(name_ + ": expected columns " +
                          (needs_heights ? "x, y, z" : "x, y and, if known, z") + ", got " + text_of(names_));
  has_heights_ = z.has_value();
  size_ = rows_.value_or(0);
  coordinates_ = {*x, *y, z.value_or(missing())};
}

bool columns::has_name(const std::string& column_name) const {
  return !table_.is_none() && py::cast<bool>(names_.attr("__contains__")(column_name));
}

std::optional<column> columns::find(const std::string& column_name) {
  if (!has_name(column_name)) return std::nullopt;
  const py::array numbers =
      as_array(py::object(table_[py::str(column_name)]), name_ + ": column " + column_name);
  if (numbers.ndim() != 1)
    throw py::value_error(name_ + ": expected one number a row in " + column_name + ", got shape " +
                          text_of(numbers.attr("shape")));
  const std::size_t rows = static_cast<std::size_t>(numbers.shape(0));
  if (rows != rows_.value_or(rows))
    throw py::value_error(name_ + ": columns differ in length: " + std::to_string(*rows_) + " and, of " +
                          column_name + ", " + std::to_string(rows));
  rows_ = rows;
  return require_numbers(numbers, column_name);
}

column columns::require_numbers(const py::array& numbers, const std::string& column_name) {
  const py::dtype type = numbers.dtype();
  const bool is_known = type.kind() == 'f' && (type.itemsize() == 4 || type.itemsize() == 8);
  if (!is_known || !py::cast<bool>(type.attr("isnative")))
    throw py::type_error(name_ + (column_name.empty() ? "" : ": column " + column_name) +
                         ": expected float32 or float64 in the byte order of the machine, got " +
                         text_of(is_known ? type.attr("str") : py::object(type)) +
                         "; astype(float) converts it");
  kept_.push_back(numbers);
  const auto* const bytes = static_cast<const std::byte*>(numbers.data());
  return {bytes, numbers.ndim() == 1 ? numbers.strides(0) : 0, type.itemsize() == 4};
}

stem_columns::stem_columns(columns& given) : position(given.coordinates()) {
  radius = given.find("radius").value_or(missing());
  position_sigma = given.find("position_sigma").value_or(missing());
  height_sigma = given.find("height_sigma").value_or(missing());
  const std::optional<column> x = given.find("axis_x"), y = given.find("axis_y"), z = given.find("axis_z");
  has_axis = x && y && z;
  axis = {x.value_or(missing()), y.value_or(missing()), z.value_or(missing())};
}

any_stem_range stem_positions(columns& given) {
  const stem_columns from(given);
  const std::size_t size = given.size();
  if (!given.has_heights())
    return stem_range<given_stem_without_height>(size, stem_reader<given_stem_without_height>{from});
  if (from.has_axis) return stem_range<given_stem_with_axis>(size, stem_reader<given_stem_with_axis>{from});
  return stem_range<given_stem>(size, stem_reader<given_stem>{from});
}

std::shared_ptr<const stem_map> stem_map_of(columns& given) {
  const stem_reader<given_stem_with_axis> read{stem_columns(given)};
  const auto map = std::make_shared<stem_map>();
  map->stems.resize(given.size());
  for (std::size_t i = 0; i < given.size(); ++i) {
    const given_stem_with_axis from = read(i);
    stem& to = map->stems[i];
    to.position = {from.position[0], from.position[1], from.position[2]};
    to.axis = {from.axis[0], from.axis[1], from.axis[2]};
    to.radius = from.radius;
    to.position_sigma = from.position_sigma;
    to.height_sigma = from.height_sigma;
  }
  if (!given.has_heights()) map->terrain.status = ground_status::none;
  map->funnel.stems = given.size();
  return map;
}

}  // namespace globalmatch::python

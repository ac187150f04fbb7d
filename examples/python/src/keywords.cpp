#include "keywords.hpp"

#include <pybind11/numpy.h>

namespace globalmatch::python {

void keywords::finish() const {
  for (const auto& [key, value] : given_) {
    if (defaults_.contains(key)) continue;
    const std::string name = prefix_ + py::cast<std::string>(py::str(key));
    const py::list near = py::module_::import("difflib").attr("get_close_matches")(
        py::str(key), py::list(defaults_.attr("keys")()), 1);
    std::string message = "there is no argument " + name;
    if (!near.empty()) message += "; is " + prefix_ + py::cast<std::string>(near[0]) + " meant?";
    throw py::type_error(message);
  }
}

void keywords::refuse(const std::string& name, const std::string& expected, py::handle value) const {
  throw py::type_error(prefix_ + name + ": expected " + expected + ", got " +
                       py::cast<std::string>(py::repr(value)));
}

void keywords::refuse_value(const std::string& name, const std::string& message) const {
  throw py::value_error(prefix_ + name + ": " + message);
}

namespace {

/// Numbers of any kind as doubles; nothing where they are none.
std::optional<py::array_t<double>> numbers_of(py::handle value) {
  auto numbers = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(value);
  if (!numbers) {
    PyErr_Clear();
    return std::nullopt;
  }
  return numbers;
}

}  // namespace

void keywords::convert(py::handle value, const std::string& name, py::object& option) const {
  if (!value.is_none() && !PyCallable_Check(value.ptr())) refuse(name, "a function", value);
  option = py::reinterpret_borrow<py::object>(value);
}

void keywords::convert(py::handle value, const std::string& name, Eigen::Vector3d& option) const {
  const auto numbers = numbers_of(value);
  if (!numbers || numbers->ndim() != 1 || numbers->shape(0) != 3) refuse(name, "three numbers", value);
  option = {numbers->at(0), numbers->at(1), numbers->at(2)};
}

void keywords::convert(py::handle value, const std::string& name, Eigen::Isometry3d& option) const {
  const auto numbers = numbers_of(value);
  if (!numbers) refuse(name, "a 4 x 4 matrix", value);
  if (numbers->ndim() != 2 || numbers->shape(0) != 4 || numbers->shape(1) != 4)
    refuse_value(
        name, "expected a 4 x 4 matrix, got shape " + py::cast<std::string>(py::str(numbers->attr("shape"))));
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) option.matrix()(r, c) = numbers->at(r, c);
  if (option.matrix().row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    refuse_value(name, "the last row of a transform is 0, 0, 0, 1");
}

}  // namespace globalmatch::python

// What several results have in common on their way to Python.
#pragma once

#include <globalmatch/matching.hpp>
#include <globalmatch/stem_map.hpp>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "support/warnings.hpp"

namespace globalmatch::python {

namespace py = pybind11;

/// An array of its own, row by row; vectors have one axis.
template <class Matrix>
py::array_t<double> as_array(const Matrix& matrix) {
  const bool is_vector = Matrix::IsVectorAtCompileTime;
  py::array_t<double> result(is_vector ? std::vector<py::ssize_t>{matrix.size()}
                                       : std::vector<py::ssize_t>{matrix.rows(), matrix.cols()});
  double* to = result.mutable_data();
  for (Eigen::Index r = 0; r < matrix.rows(); ++r)
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) *to++ = matrix(r, c);
  return result;
}

/// 4 x 4.
inline py::array_t<double> as_array(const Eigen::Isometry3d& transform) {
  return as_array(transform.matrix());
}

/// None where there is none.
inline py::object as_array(const std::optional<Eigen::Isometry3d>& transform) {
  if (!transform) return py::none();
  return as_array(*transform);
}

inline py::str as_str(std::string_view text) {
  return py::str(text.data(), text.size());
}

/// A property that is an array made of a member.
template <class Class, class Member>
auto array_of(Member Class::*member) {
  return [member](const Class& self) { return as_array(self.*member); };
}

/// A property that is the name of an enumerator.
template <class Class, class Member>
auto name_of(Member Class::*member) {
  return [member](const Class& self) { return as_str(to_string(self.*member)); };
}

/// Rows as a structured array.
template <class Row>
py::array_t<Row> as_rows(const std::vector<Row>& rows) {
  py::array_t<Row> result(static_cast<py::ssize_t>(rows.size()));
  std::copy(rows.begin(), rows.end(), result.mutable_data());
  return result;
}

/// The numbers of a vector that `owner` holds, N or N x 3, not to be written to.
template <class T>
py::array view_of(const std::vector<T>& numbers, py::handle owner) {
  using scalar = std::conditional_t<std::is_arithmetic_v<T>, T, double>;
  const auto count = static_cast<py::ssize_t>(numbers.size());
  py::array result = std::is_arithmetic_v<T>
                         ? py::array(py::dtype::of<scalar>(), {count},
                                     reinterpret_cast<const scalar*>(numbers.data()), owner)
                         : py::array(py::dtype::of<scalar>(), {count, py::ssize_t(3)},
                                     reinterpret_cast<const scalar*>(numbers.data()), owner);
  result.attr("setflags")(py::arg("write") = false);
  return result;
}

/// The steps of a funnel, a dictionary each.
py::list describe(const std::vector<funnel_step>& steps);
/// Pairs of code and text.
py::list describe(const std::vector<support::warning>& warnings);
/// Those of a map, with one of stems that are clearly tilted.
std::vector<support::warning> all_warnings_of(const stem_map& map);

/// A representation by some properties: "<Scale: factor 1.0, sigma 0.0001>".
std::string represent_by(const py::object& self, std::initializer_list<const char*> properties);

/// "<Matching: registered, ...>"
std::string represent(const matching& result);

/// Adds the classes and functions of one file to the module.
void add_stem_maps(py::module_& module);
void add_matchings(py::module_& module);
void add_registrations(py::module_& module);
void add_surveys(py::module_& module);

}  // namespace globalmatch::python

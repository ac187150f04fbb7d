// Functions of the module: some arguments by place or by name, as the data are, and options by name alone.
#pragma once

#include <pybind11/pybind11.h>

#include <array>
#include <string>
#include <tuple>

namespace globalmatch::python {

namespace py = pybind11;

template <std::size_t N>
using argument_names = std::array<const char*, N>;

/// Takes those that are given by name out of `options`. Throws `TypeError` that names what is missing or too
/// much; pybind11 alone would show all that was given in place of it.
template <std::size_t N>
std::array<py::object, N> read_arguments(const char* function, const argument_names<N>& names,
                                         const py::args& by_place, py::dict& options) {
  const auto refuse = [&](const std::string& message) {
    throw py::type_error(std::string(function) + ": " + message);
  };
  if (by_place.size() > N)
    refuse("got " + std::to_string(by_place.size()) + " arguments by place, takes " + std::to_string(N) +
           "; options are given by name, as threads=2");
  std::array<py::object, N> arguments;
  for (std::size_t k = 0; k < N; ++k) {
    const bool is_named = options.contains(names[k]);
    if (is_named && k < by_place.size()) refuse(std::string(names[k]) + " is given twice");
    if (!is_named && k >= by_place.size()) refuse("the argument " + std::string(names[k]) + " is missing");
    arguments[k] = is_named ? py::object(options[names[k]]) : py::object(by_place[k]);
    if (is_named) options.attr("pop")(names[k]);
  }
  return arguments;
}

/// `function(arguments..., options)` as `name` of the module; its documentation says how it is called.
template <std::size_t N, class Function>
void define(py::module_& module, const char* name, const argument_names<N>& names, Function function,
            const std::string& text) {
  std::string head = name + std::string("(");
  for (std::size_t k = 0; k < N; ++k) head += std::string(k > 0 ? ", " : "") + names[k];
  py::options form;
  form.disable_function_signatures();
  module.def(
      name,
      [=](const py::args& by_place, const py::kwargs& by_name) {
        py::dict options(py::reinterpret_steal<py::object>(PyDict_Copy(by_name.ptr())));
        const auto arguments = read_arguments(name, names, by_place, options);
        return std::apply([&](const auto&... each) { return function(each..., options); }, arguments);
      },
      (head + ", **options)\n--\n\n" + text).c_str());
}

/// An argument of a class of this module. Throws `TypeError`, which names it.
template <class T>
T argument_of_class(const py::object& given, const char* name, const char* expected) {
  try {
    if (!given.is_none()) return py::cast<T>(given);
  } catch (const py::cast_error&) {
  }
  throw py::type_error(std::string(name) + ": expected " + expected + ", got " +
                       py::cast<std::string>(py::str(py::type::of(given).attr("__name__"))));
}

}  // namespace globalmatch::python

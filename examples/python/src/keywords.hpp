// Keyword arguments as options: each is named once, with its place in the options of the library.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <Eigen/Geometry>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace globalmatch::python {

namespace py = pybind11;

/// Enumerators by name: specialised for each enumeration that is an option, as an array of pairs.
template <class E>
struct enumerators;

/// Keyword arguments on their way into options. What was read is known; `finish` refuses the rest.
class keywords {
 public:
  /// `prefix` goes before names in messages: "", "ground.".
  explicit keywords(py::dict given, std::string prefix = "") : given_(given), prefix_(std::move(prefix)) {}

  /// Reads one that may be missing. Throws `TypeError` or `ValueError`, which name it.
  template <class T>
  keywords& read(const char* name, T& option) {
    defaults_[name] = as_python(option);
    if (given_.contains(name)) convert(given_[name], name, option);
    return *this;
  }

  /// Reads a dictionary whose keys are those of `read_fields(fields, options)`; where `short_form` is a key,
  /// a value that is no dictionary stands for that key.
  template <class Options>
  keywords& group(const char* name, Options& options, const char* short_form = nullptr) {
    py::dict inner;
    if (given_.contains(name)) {
      const py::object value = given_[name];
      if (py::isinstance<py::dict>(value))
        inner = value;
      else if (short_form)
        inner[short_form] = value;
      else
        refuse(name, "a dictionary of options", value);
    }
    keywords fields(inner, prefix_ + name + ".");
    read_fields(fields, options);
    defaults_[name] = fields.defaults();
    fields.finish();
    return *this;
  }

  /// Reads one that must be given.
  template <class T>
  keywords& require(const char* name, T& option) {
    if (!has(name)) refuse_value(name, "it must be given");
    return read(name, option);
  }

  /// Reads a list of dictionaries, whose keys are those of `read_fields`.
  template <class Options>
  keywords& list(const char* name, std::vector<Options>& options) {
    defaults_[name] = py::tuple();
    if (!has(name)) return *this;
    const char* const expected = "a list of dictionaries";
    if (!py::isinstance<py::sequence>(given_[name])) refuse(name, expected, given_[name]);
    for (const py::handle item : py::object(given_[name])) {
      if (!py::isinstance<py::dict>(item)) refuse(name, expected, item);
      keywords fields(py::reinterpret_borrow<py::dict>(item),
                      prefix_ + name + "[" + std::to_string(options.size()) + "].");
      read_fields(fields, options.emplace_back());
      fields.finish();
    }
    return *this;
  }

  bool has(const char* name) const { return given_.contains(name); }
  /// All that were read, with the values that options had before.
  const py::dict& defaults() const { return defaults_; }
  /// Throws `TypeError` that names what was given and not read, and the nearest name that there is.
  void finish() const;

 private:
  [[noreturn]] void refuse(const std::string& name, const std::string& expected, py::handle value) const;
  [[noreturn]] void refuse_value(const std::string& name, const std::string& message) const;

  template <class T>
  void convert(py::handle value, const std::string& name, T& option) const {
    if constexpr (std::is_enum_v<T>) {
      convert_name(value, name, option);
    } else {
      try {
        if (value.is_none()) throw py::cast_error();  // which is a false truth value for pybind11
        option = py::cast<T>(value);
      } catch (const py::cast_error&) {
        refuse(name, expected_type<T>(), value);
      }
    }
  }
  template <class T>
  void convert(py::handle value, const std::string& name, std::optional<T>& option) const {
    option.reset();
    if (!value.is_none()) convert(value, name, option.emplace());
  }
  void convert(py::handle value, const std::string& name, py::object& option) const;  // a function, or None
  void convert(py::handle value, const std::string& name, Eigen::Vector3d& option) const;
  void convert(py::handle value, const std::string& name, Eigen::Isometry3d& option) const;

  template <class E>
  void convert_name(py::handle value, const std::string& name, E& option) const {
    std::string known;
    for (const auto& [enumerator, is] : enumerators<E>::all) {
      if (py::cast(enumerator).equal(value)) {
        option = is;
        return;
      }
      known += (known.empty() ? "" : ", ") + py::cast<std::string>(py::repr(py::cast(enumerator)));
    }
    refuse(name, "one of " + known, value);
  }

  template <class T>
  static const char* expected_type() {
    if constexpr (std::is_same_v<T, bool>) return "True or False";
    if constexpr (std::is_integral_v<T>) return "an integer";
    if constexpr (std::is_floating_point_v<T>) return "a number";
    if constexpr (std::is_same_v<T, std::string>) return "a string";
    return "three numbers";
  }

  template <class T>
  static py::object as_python(const T& option) {
    if constexpr (std::is_enum_v<T>) {
      for (const auto& [enumerator, is] : enumerators<T>::all)
        if (is == option) return py::cast(enumerator);
      return py::none();
    } else {
      return py::cast(option);
    }
  }
  template <class T>
  static py::object as_python(const std::optional<T>& option) {
    if (!option) return py::none();
    return as_python(*option);
  }
  static py::object as_python(const Eigen::Vector3d& v) { return py::make_tuple(v.x(), v.y(), v.z()); }
  static py::object as_python(const Eigen::Isometry3d&) { return py::none(); }
  static py::object as_python(const py::object& function) { return function; }

  py::dict given_, defaults_;
  std::string prefix_;
};

}  // namespace globalmatch::python

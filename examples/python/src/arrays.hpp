// NumPy arrays, structured arrays and tables of columns, read where they lie.
#pragma once

#include <globalmatch/points.hpp>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace globalmatch {
struct stem_map;
}

namespace globalmatch::python {

namespace py = pybind11;

/// Numbers in the memory of an array: one every `stride` bytes. All are 0 where there is no such memory.
struct column {
  const std::byte* first = nullptr;
  std::ptrdiff_t stride = 0;
  bool is_single = false;  ///< float32, otherwise float64

  double operator[](std::size_t i) const {
    const std::byte* const at = first + static_cast<std::ptrdiff_t>(i) * stride;
    return is_single ? double(read<float>(at)) : read<double>(at);
  }

 private:
  template <class T>
  static T read(const std::byte* at) {
    T number;
    std::memcpy(&number, at, sizeof(T));  // strides may leave it unaligned
    return number;
  }
};

/// The columns of what a caller gave: an N x 3 array (N x 2 where heights are optional), a structured array,
/// a table such as a DataFrame, or a dictionary of arrays. Keeps the memory alive; to be used with the GIL.
class columns {
 public:
  /// `name` is that of the argument, for messages. Throws `TypeError` or `ValueError`.
  columns(py::handle given, std::string name, bool needs_heights);

  std::size_t size() const { return size_; }
  bool has_heights() const { return has_heights_; }
  /// x, y and z; a z that is missing is 0.
  const std::array<column, 3>& coordinates() const { return coordinates_; }
  /// Nothing where there is none of that name. Throws `TypeError` or `ValueError`.
  std::optional<column> find(const std::string& column_name);

 private:
  void read_matrix(const py::array& matrix, bool needs_heights);
  void read_coordinates(bool needs_heights);
  column require_numbers(const py::array& numbers, const std::string& column_name);
  bool has_name(const std::string& column_name) const;

  std::string name_;
  py::object table_;  // structured array, DataFrame or dictionary; None: a matrix
  py::object names_;  // of its columns
  std::vector<py::array> kept_;
  std::optional<std::size_t> rows_;
  std::size_t size_ = 0;
  bool has_heights_ = true;
  std::array<column, 3> coordinates_;
};

/// A scan as a `point_range`.
struct point_reader {
  std::array<column, 3> coordinates;
  std::array<double, 3> operator()(std::size_t i) const {
    return {coordinates[0][i], coordinates[1][i], coordinates[2][i]};
  }
};

inline auto scan_points(const columns& scan) {
  return indexed_points(scan.size(), point_reader{scan.coordinates()});
}

/// A stem as the caller knows it; 0 stands for unknown.
struct given_stem {
  std::array<double, 3> position;
  double radius, position_sigma, height_sigma;
};
struct given_stem_with_axis : given_stem {
  std::array<double, 3> axis;
};
struct given_stem_without_height : given_stem {};

/// What is known of stems beside their coordinates.
struct stem_columns {
  std::array<column, 3> position;
  column radius, position_sigma, height_sigma;
  std::array<column, 3> axis;
  bool has_axis = false;

  explicit stem_columns(columns& given);
};

template <class Stem>
struct stem_reader {
  stem_columns from;
  Stem operator()(std::size_t i) const {
    Stem stem;
    stem.position = {from.position[0][i], from.position[1][i], from.position[2][i]};
    stem.radius = from.radius[i];
    stem.position_sigma = from.position_sigma[i];
    stem.height_sigma = from.height_sigma[i];
    if constexpr (std::is_same_v<Stem, given_stem_with_axis>)
      stem.axis = {from.axis[0][i], from.axis[1][i], from.axis[2][i]};
    return stem;
  }
};

template <class Stem>
using stem_range = indexed_points<stem_reader<Stem>>;
using any_stem_range = std::variant<stem_range<given_stem>, stem_range<given_stem_with_axis>,
                                    stem_range<given_stem_without_height>>;

/// Stems as a `position_range`, of the type that says what is known of them. Refers to the memory of `given`.
any_stem_range stem_positions(columns& given);

/// Stems as a map that holds nothing else.
std::shared_ptr<const stem_map> stem_map_of(columns& given);

}  // namespace globalmatch::python

template <>
struct globalmatch::point_traits<globalmatch::python::given_stem> {
  using stem = python::given_stem;
  static const std::array<double, 3>& xyz(const stem& s) { return s.position; }
  static double radius(const stem& s) { return s.radius; }
  static double position_sigma(const stem& s) { return s.position_sigma; }
  static double height_sigma(const stem& s) { return s.height_sigma; }
};

template <>
struct globalmatch::point_traits<globalmatch::python::given_stem_with_axis>
    : globalmatch::point_traits<globalmatch::python::given_stem> {
  static const std::array<double, 3>& axis(const python::given_stem_with_axis& s) { return s.axis; }
};

template <>
struct globalmatch::point_traits<globalmatch::python::given_stem_without_height>
    : globalmatch::point_traits<globalmatch::python::given_stem> {
  static constexpr int dimension = 2;
};

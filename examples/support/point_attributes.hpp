// What points have besides coordinates, as readers give it and writers take it.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "support/scalars.hpp"

namespace globalmatch::support {

/// A number of each point.
struct attribute {
  std::string name;  ///< as the file names it; those of the LAS specification as `las_fields` does
  scalar type = scalar::float64;
  double scale = 1, offset = 0;  ///< the value is the stored number * scale + offset
  bool operator==(const attribute&) const = default;
};

/// The stored numbers of one attribute of some points, of its type and in the native byte order.
struct attribute_column {
  std::size_t attribute = 0;  ///< index in `point_source::attributes()`
  std::vector<char> numbers;
};

/// Attributes of points in memory.
class attribute_table {
 public:
  attribute_table() = default;
  explicit attribute_table(std::vector<attribute> attributes)
      : attributes_(std::move(attributes)), numbers_(attributes_.size()) {}

  const std::vector<attribute>& attributes() const { return attributes_; }
  bool empty() const { return attributes_.empty(); }

  /// Of numbers of type double.
  static attribute_table of_names(const std::vector<std::string>& names);

  /// Appends the stored number of the next point, rounded to the type of the attribute.
  void append(std::size_t attribute, double number);
  void read(std::size_t first, std::size_t count, std::span<attribute_column> columns) const;

 private:
  std::vector<attribute> attributes_;
  std::vector<std::vector<char>> numbers_;  // of each attribute, in the native byte order
};

/// The nearest number that a type can store; zero for not-a-number.
template <class T>
T nearest(double value) {
  if constexpr (std::is_floating_point_v<T>) {
    return static_cast<T>(value);
  } else {
    using limits = std::numeric_limits<T>;
    if (std::isnan(value)) return 0;
    const double rounded = std::round(value);
    if (rounded <= static_cast<double>(limits::min())) return limits::min();
    // The double next to the largest number of 64 bits is beyond it.
    if (rounded >= static_cast<double>(limits::max())) return limits::max();
    return static_cast<T>(rounded);
  }
}

/// The names by which LAS attributes go, whatever the file calls them: `intensity`, `return_number`,
/// `number_of_returns`, `scan_direction_flag`, `edge_of_flight_line`, `classification`, `synthetic`,
/// `key_point`, `withheld`, `overlap`, `scanner_channel`, `scan_angle`, `user_data`, `point_source_id`,
/// `gps_time`, `red`, `green`, `blue`, `near_infrared`. Other names are returned as they are, with `_` where
/// a PLY property can have no blank.
std::string common_name(std::string_view name);

/// Whether all values of a stored type are values of another.
bool holds_all_of(scalar type, scalar other);

}  // namespace globalmatch::support

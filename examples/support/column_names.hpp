// Internal to the readers of tables: what a column holds, as its name says.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace globalmatch::support {

enum class quantity { x, y, z, radius, diameter, other };

/// What the name of a column says.
struct column_meaning {
  quantity what = quantity::other;
  int rank = 0;                ///< 0: the usual name, as x; the more, the less usual
  std::optional<double> unit;  ///< [m] if there is one of length
  bool is_angle = false;       ///< in degrees
};

/// The meaning of a name in any case, with quotes, a unit in brackets or after it, and words around it such
/// as `tree` or `coord`: `x`, `X(m)`, `tree_x`, `gx`, `Easting`, `Points:0`. E, N and H are understood beside
/// each other only (`find_columns`).
column_meaning meaning_of(std::string_view name);

/// Where the columns of a table are that matter.
struct known_columns {
  std::optional<std::size_t> x, y, z, radius, diameter;
  std::vector<double> units;  ///< [m] of each column; 1 where none is named
};

/// Whose heights a column `height` holds: the ground's in scans, the trees' in stem maps.
enum class table_of { points, stems };

/// The columns of a header. `problem` says, if it does not become empty, why there is no telling: two columns
/// that may be the same coordinate, or angles.
known_columns find_columns(const std::vector<std::string_view>& names, table_of kind, std::string& problem);

}  // namespace globalmatch::support

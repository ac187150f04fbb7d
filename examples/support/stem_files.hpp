// Stem maps as CSV tables: x,y,z,radius, one stem a line, lengths in metres.
#pragma once

#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace globalmatch::support {

struct stem_record {
  double x = 0, y = 0, z = 0;  ///< [m] where the stem meets the ground, in the frame of the file
  double radius = std::numeric_limits<double>::quiet_NaN();  ///< [m] NaN: not known
};

struct stem_table {
  std::vector<stem_record> stems;  ///< in the order of the file
  bool has_heights = false;        ///< all stems have a z; else all z are 0
  bool has_radii = false;          ///< there is a column radius or dbh; without it all radii are NaN
  std::vector<std::string> notes;  ///< what was understood that the user should know of
};

/// A further column to write; its name holds no comma, quote or line end.
struct stem_column {
  std::string name;
  std::vector<double> values;  ///< one for each stem; NaN leaves the field empty
};

/// Reads a table, separated by commas, semicolons, tabs or blanks. A line above the rows names the columns,
/// in any order and case and with units: x and y (or easting and northing, gx and gy, ...), optionally z and
/// radius, or dbh (diameter, halved). Others are ignored, as text too; fields may be quoted. A radius may be
/// missing (empty, NA, -9999, ...); lengths that no tree has in metres are taken for centimetres or
/// millimetres. Where some stems have no z heights are not used; rows without x and y are left out. `notes`
/// says so. A header without rows is an empty map. Throws `file_error`, naming line and column, for what is
/// none of these.
stem_table read_stems(const std::filesystem::path& path);

/// Writes x, y, z, radius and further columns; reading yields the same values again. Throws `file_error` when
/// the file cannot be written, and `std::invalid_argument` when a further column has not a value for each
/// stem.
void write_stems(const std::filesystem::path& path, std::span<const stem_record> stems,
                 std::span<const stem_column> further = {});

}  // namespace globalmatch::support

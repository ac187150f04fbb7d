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
  bool has_heights = false;        ///< there is a column z; without it all z are 0
  bool has_radii = false;          ///< there is a column radius or dbh; without it all radii are NaN
};

/// A further column to write; its name holds no comma, quote or line end.
struct stem_column {
  std::string name;
  std::vector<double> values;  ///< one for each stem; NaN leaves the field empty
};

/// Reads a table separated by commas, semicolons or blanks. Its first line names the columns, in any order
/// and case: x and y, optionally z and radius, or dbh (diameter in metres, halved). Others are ignored, as
/// text too; fields may be quoted. A radius may be missing (empty, NA or nan). A header without rows is an
/// empty map. Throws `file_error`, naming line and column, when x, y or z is missing or not finite.
stem_table read_stems(const std::filesystem::path& path);

/// Writes x, y, z, radius and further columns; reading yields the same values again. Throws `file_error` when
/// the file cannot be written, and `std::invalid_argument` when a further column has not a value for each
/// stem.
void write_stems(const std::filesystem::path& path, std::span<const stem_record> stems,
                 std::span<const stem_column> further = {});

}  // namespace globalmatch::support

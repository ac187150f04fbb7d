// Internal to the readers: lines of text cut into fields, and fields made numbers.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "support/input_file.hpp"

namespace globalmatch::support {

/// The text without blanks, tabs and line ends around it.
std::string_view trim(std::string_view text);

/// The start of a text in quotes, for messages: control characters are blanks.
std::string quoted(std::string_view text);

/// ASCII letters made small: how column names are compared.
std::string lower_case(std::string_view text);

/// The number that makes up the whole field ("nan" and "inf" are numbers too); empty when it is none.
std::optional<double> to_number(std::string_view field);

/// The same with decimal commas; or with points, and commas between groups of three digits (1,234.5). What
/// some programs write for no number (-1.#IND) is none.
std::optional<double> to_number(std::string_view field, bool decimal_comma);

/// The count that makes up the whole field; empty when it is none or beyond 64 bits.
std::optional<std::uint64_t> to_count(std::string_view field);

/// What separates the fields of this line: ';' or ',' where there is one, else ' ' for runs of blanks and
/// tabs. A semicolon wins, so that decimal commas are not taken for separators.
char separator_of(std::string_view line);

/// Hands out the fields of a line one by one, without the blanks and the quotes around them. Fields between
/// tabs may be empty, and hold blanks.
class field_reader {
 public:
  field_reader(std::string_view line, char separator);
  /// The next field; empty when the line has no more. Refers to the line.
  std::optional<std::string_view> next();
  /// The number of fields not yet handed out.
  std::size_t count_left() const;

 private:
  std::string_view rest_;
  char separator_;
  bool at_end_;
};

/// All fields of a line, as `field_reader` hands them out.
std::vector<std::string_view> split(std::string_view line, char separator);

/// The numbers in three columns of the current line of a file. Throws `file_error` naming line and column.
Eigen::Vector3d read_columns(const input_file& file, std::string_view line, char separator,
                             const std::array<std::size_t, 3>& columns);

/// Calls `use(k, number)` for the fields of a line behind the first three, not-a-number where there is none.
template <class Use>
void read_behind_xyz(std::string_view line, char separator, std::size_t count, const Use& use) {
  field_reader fields(line, separator);
  for (int k = 0; k < 3; ++k) fields.next();
  for (std::size_t k = 0; k < count; ++k) {
    const auto field = fields.next();
    const auto number = field ? to_number(*field) : std::nullopt;
    use(k, number.value_or(std::numeric_limits<double>::quiet_NaN()));
  }
}

/// Whether a line with something in it follows. Moves the cursor.
bool has_text_behind(input_file& file);

/// What the columns of a scan without a header are, x, y and z first: those that scanners' programs write, of
/// 4, 6 or 7 columns, are known; others are `column_4` and so on.
std::vector<std::string> names_behind_xyz(std::size_t columns);

}  // namespace globalmatch::support

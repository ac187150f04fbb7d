// Internal to the readers: tables of text, as spreadsheets, statistics programs and scanners write them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "support/announced_blocks.hpp"
#include "support/column_names.hpp"
#include "support/input_file.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

/// Whether a number stands for one that is not known, in any spelling: -9999, -99999, -32768, their like, and
/// not-a-number.
bool is_unknown_number(double number);

/// Lines of numbers, with or without a header. What stands above them is read at once: comments, a title,
/// `sep=;`, counts, the names of columns, their units. Never guesses: a header that names no coordinates is
/// refused. Lines that say nothing are passed over.
class table_reader {
 public:
  /// Reads what stands above the rows, and looks at the first rows to tell how they are cut. Throws
  /// `file_error`, quoting the header.
  table_reader(input_file& file, table_of kind);

  /// The columns; without a header the first three are x, y and z.
  const known_columns& columns() const { return columns_; }
  bool has_header() const { return !names_.empty(); }
  /// Names of the columns; empty without a header.
  const std::vector<std::string>& names() const { return names_; }
  /// Rows are cut into all of their cells, not only those of the coordinates.
  void keep_all_cells() { needed_cells_ = std::size_t(-1); }
  /// The number of rows that the lines with only a count announce, if there are any.
  std::optional<std::uint64_t> announced() const { return blocks_.announced(); }

  /// The next row, cut into cells; false at the end. Throws `file_error` where it has not as many cells as
  /// the header has names, and where a block of a PTS file ends that holds other than it announces.
  bool next();
  /// Cells of the current row, which refer to it.
  const std::vector<std::string_view>& cells() const { return cells_; }
  /// The number that a cell of the current row is.
  std::optional<double> number(std::size_t column) const;
  /// The same in the unit of the file.
  std::optional<double> number_as_written(std::size_t column) const;
  /// Whether a cell says that its value is not known, by a word such as NA, a number such as -9999, or
  /// because it is empty.
  bool says_unknown(std::size_t column) const;
  /// Throws `file_error` for the current row.
  [[noreturn]] void fail_at_row(std::string_view problem, std::string_view remedy) const;

 private:
  struct numbered_line {
    std::string text;
    std::size_t number;
  };

  void read_header();
  using cell_check = std::function<bool(std::size_t)>;  // whether rows have so many cells
  void take_comment(std::string_view comment);
  bool is_doubtful(std::string_view comment, const cell_check& has_cells) const;
  bool take_header(std::string_view header, const cell_check& has_cells);
  void take_next_header();
  void take_units();
  void find_format();
  bool fits(char separator, bool decimal_comma, std::size_t row_names) const;
  bool has_quoted_decimals() const;
  bool may_have_row_names(char separator) const;
  bool counts_rows(const std::vector<std::string_view>& first_cells) const;
  bool starts_with_no_coordinate(char separator, bool decimal_comma) const;
  bool has_commas_of_two_kinds() const;
  void check_first_columns(const std::vector<std::string_view>& first_cells, const std::string& row) const;
  // Cuts off at most so many cells; returns the number of all.
  static std::size_t cut(std::string_view line, char separator, std::size_t row_names,
                         std::vector<std::string_view>& cells, std::size_t max_cells);
  bool is_comment(std::string_view line) const;
  void require_same_sign(std::string_view line);
  bool is_no_row(std::string_view line) const;
  bool is_count(std::string_view line) const;

  input_file& file_;
  table_of kind_;
  std::deque<numbered_line> ahead_;  // lines that were looked at
  std::vector<std::string> names_;   // of columns
  std::string doubtful_comment_;     // names coordinates, but does not fit the rows
  char header_separator_ = 0;
  bool is_open_ended_ = false;  // the header ends with an empty name: more cells may follow
  known_columns columns_;
  announced_blocks blocks_;              // of a PTS file
  std::optional<char> given_separator_;  // by a line `sep=;`
  char separator_ = ' ';
  bool decimal_comma_ = false;
  std::size_t row_names_ = 0;  // cells before those that have names
  std::size_t needed_cells_ = std::size_t(-1);
  std::optional<bool> rows_have_sign_;  // of comments, in front
  std::string line_;                    // the current row
  std::size_t line_number_ = 0;
  std::vector<std::string_view> cells_;
};

}  // namespace globalmatch::support

// Tables of what is known of scans: comma-separated, the columns named by the header.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace globalmatch::support {

/// A line of a table, its cells by the names of their columns.
class named_row {
 public:
  named_row(const std::filesystem::path& file, std::size_t line, std::map<std::string, std::string> cells)
      : file_(file), line_(line), cells_(std::move(cells)) {}

  /// Empty where there is no such column.
  std::string text(const std::string& column) const;
  /// Not a number where the cell is empty. Throws `file_error` naming line and column.
  double number(const std::string& column) const;
  /// The standard deviation of something, which is needed where that is known; else 1.
  double sigma(const std::string& column, bool is_needed) const;
  /// Throws `file_error` for this line, with what helps.
  [[noreturn]] void fail(const std::string& problem, const std::string& remedy =
                                                         "Write a number, or leave the field empty where "
                                                         "nothing is known.") const;

 private:
  std::filesystem::path file_;
  std::size_t line_;
  std::map<std::string, std::string> cells_;
};

/// The lines of a table whose header names some of `columns`, in any order, the first of them at least; every
/// line has a value in that one, or none at all and is left out. Throws `file_error` naming the line.
std::vector<named_row> read_named_table(const std::filesystem::path& file,
                                        const std::vector<std::string>& columns);

}  // namespace globalmatch::support

// Transforms of many scans or pairs in one file, as published sets have them.
#pragma once

#include <Eigen/Geometry>

#include "support/file_error.hpp"
#include "support/input_file.hpp"
#include "support/text_fields.hpp"
#include "support/transform_files.hpp"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

/// A rigid transform, and whose it is: of one scan, or of a pair, source first.
struct named_transform {
  std::vector<std::string> names;  ///< one or two
  Eigen::Isometry3d transform;
  std::string place;  ///< file, and line where it holds several
};

/// Whether entries of two names or more begin with 0, 1, 2, ..., or as from another number.
inline bool first_names_count(const std::vector<named_transform>& entries) {
  const std::optional<double> first = support::to_number(entries[0].names[0]);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto number = support::to_number(entries[i].names[0]);
    if (entries[i].names.size() < 2 || !first || !number || *number != *first + double(i)) return false;
  }
  return true;
}

/// Collects the entries of a table.
class matrix_table_reader {
 public:
  explicit matrix_table_reader(const std::filesystem::path& path) : file_(path) {
    while (const auto line = file_.read_line()) read(*line);
    if (!numbers_.empty() || (!names_.empty() && !entries_.empty())) fail("ends within a matrix");
    if (entries_.empty()) fail("holds no matrix with the name of a scan or of two");
    if (has_index_column())
      for (named_transform& entry : entries_) entry.names.erase(entry.names.begin());
    for (const named_transform& entry : entries_)
      if (entry.names.size() > 2) fail("has three names before each matrix");
  }

  std::vector<named_transform> entries() && { return std::move(entries_); }

 private:
  static constexpr const char* remedy =
      "Write lines of one or two names of scans and 16 numbers, or the names and four lines of four numbers";

  [[noreturn]] void fail(std::string_view problem) const { file_.fail_at_line(problem, remedy); }

  void read(std::string_view line) {
    if (support::trim(line).empty() || support::trim(line).starts_with('#')) return;
    std::vector<std::string_view> fields = support::split(line, support::separator_of(line));
    std::erase_if(fields, [](std::string_view field) { return field.empty(); });
    if (fields.size() <= 3)
      read_names(fields);
    else if (fields.size() == 4 && !names_.empty())
      read_row(fields);
    else
      read_whole(fields, line);
  }

  void read_names(const std::vector<std::string_view>& fields) {
    if (!numbers_.empty()) fail("is no row of a matrix");
    names_.assign(fields.begin(), fields.end());
    if (names_.size() == 3) names_.pop_back();
  }

  void read_row(const std::vector<std::string_view>& fields) {
    append(fields, 0);
    if (numbers_.size() == 16) finish();
  }

  void read_whole(const std::vector<std::string_view>& fields, std::string_view line) {
    const std::size_t count = fields.size() > 16 ? 16 : 12;
    const std::size_t names = fields.size() - count;
    const bool has_names = fields.size() > count && names <= 3;
    if (!has_names || !support::to_number(fields.back())) {
      if (entries_.empty() && !support::to_number(fields.back())) return read_header(line);
      fail("has " + std::to_string(fields.size()) + " fields");
    }
    names_.assign(fields.begin(), fields.begin() + std::ptrdiff_t(names));
    append(fields, names);
    if (count == 12) numbers_.insert(numbers_.end(), {0, 0, 0, 1});
    finish();
  }

  // Its first column may count the rows, as tables of pandas do.
  void read_header(std::string_view line) {
    const std::string first =
        support::lower_case(std::string(support::split(line, support::separator_of(line)).front()));
    for (const char* name : {"", "index", "idx", "id", "no", "nr", "row", "unnamed: 0"})
      header_has_index_ |= first == name;
  }

  /// Whether the first of several names counts the lines: the header says so, or what follows never is a
  /// number.
  bool has_index_column() const {
    const bool others_are_names =
        std::none_of(entries_.begin(), entries_.end(), [](const named_transform& entry) {
          return entry.names.size() < 2 || support::to_number(entry.names[1]);
        });
    return first_names_count(entries_) && (header_has_index_ || others_are_names);
  }

  void append(const std::vector<std::string_view>& fields, std::size_t first) {
    for (std::size_t i = first; i < fields.size(); ++i) {
      const auto number = support::to_number(fields[i]);
      if (!number) fail("has " + support::quoted(fields[i]) + " where a number is expected");
      numbers_.push_back(*number);
    }
  }

  void finish() {
    const auto at_line = [&](const std::string& problem, const std::string& help) {
      file_.fail_at_line(problem, help);
    };
    const std::string place = file_.path().string() + ", line " + std::to_string(file_.line_number());
    entries_.push_back({names_, support::to_transform(numbers_, at_line), place});
    names_.clear();
    numbers_.clear();
  }

  support::input_file file_;
  std::vector<std::string> names_;
  std::vector<double> numbers_;
  std::vector<named_transform> entries_;
  bool header_has_index_ = false;
};

/// Reads the entries of a table. Each is a line of the name of a scan, or of two, and the 16 numbers of a
/// matrix row by row, or its first 12; or a line of names, and the matrix in the four lines below. A third
/// name is ignored: it counts the scans. Fields are separated by commas, semicolons, blanks or tabs; a header,
/// lines that begin with #, and a first column that counts the lines are passed over.
inline std::vector<named_transform> read_matrix_table(const std::filesystem::path& path) {
  return matrix_table_reader(path).entries();
}

}  // namespace globalmatch::benchmarks

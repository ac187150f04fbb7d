#include "support/programs/named_table.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <string_view>

#include "support/file_error.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace fs = std::filesystem;

namespace {

/// The columns of the header, which names those that are known, and no others.
std::vector<std::string> columns_of(const fs::path& file, std::string header,
                                    const std::vector<std::string>& known) {
  if (header.starts_with("\xEF\xBB\xBF")) header.erase(0, 3);
  std::vector<std::string> columns;
  for (const std::string_view cell : split(header, ',')) {
    const bool is_known = std::find(known.begin(), known.end(), cell) != known.end();
    if (!is_known || std::find(columns.begin(), columns.end(), cell) != columns.end()) {
      std::string names;
      for (const std::string& name : known) names += (names.empty() ? "" : ",") + name;
      throw file_error(file, "has the header \"" + header + "\"", "The columns are " + names + ".");
    }
    columns.emplace_back(cell);
  }
  if (std::find(columns.begin(), columns.end(), known[0]) == columns.end())
    throw file_error(file, "has no column " + known[0],
                     "Name the " + known[0] + " of each line, as in poses.csv.");
  return columns;
}

}  // namespace

std::string named_row::text(const std::string& column) const {
  const auto found = cells_.find(column);
  return found == cells_.end() ? "" : found->second;
}

double named_row::number(const std::string& column) const {
  const std::string cell = text(column);
  if (cell.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto value = to_number(cell);
  if (!value || !std::isfinite(*value)) fail("\"" + cell + "\" in column " + column);
  return *value;
}

double named_row::sigma(const std::string& column, bool is_needed) const {
  const double value = number(column);
  if (is_needed && !(value > 0)) fail(column + " must be a positive number");
  return is_needed ? value : 1;
}

void named_row::fail(const std::string& problem, const std::string& remedy) const {
  throw file_error(file_, "line " + std::to_string(line_) + ": " + problem, remedy);
}

std::vector<named_row> read_named_table(const fs::path& file, const std::vector<std::string>& columns) {
  std::ifstream in(file);
  std::string line;
  if (!in || !std::getline(in, line))
    throw file_error(file, "cannot be read, or is empty", "Check its path.");
  const std::vector<std::string> names = columns_of(file, line, columns);
  std::vector<named_row> rows;
  for (std::size_t number = 2; std::getline(in, line); ++number) {
    const std::vector<std::string_view> cells = split(line, ',');
    std::map<std::string, std::string> by_name;
    for (std::size_t i = 0; i < std::min(cells.size(), names.size()); ++i) by_name[names[i]] = cells[i];
    const named_row row(file, number, std::move(by_name));
    if (cells.size() > names.size())
      row.fail("there are more fields than columns", "Separate fields by commas, decimals by a point.");
    if (!row.text(columns[0]).empty())
      rows.push_back(row);
    else if (std::any_of(cells.begin(), cells.end(), [](const auto& cell) { return !cell.empty(); }))
      row.fail("the " + columns[0] + " has no name", "Name it as in poses.csv.");
  }
  return rows;
}

}  // namespace globalmatch::support

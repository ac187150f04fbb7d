#include "support/programs/survey_priors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <string_view>

#include "support/file_error.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace fs = std::filesystem;

namespace {

constexpr std::array<std::string_view, 8> column_names = {"scan",    "x",        "y",       "z",
                                                          "yaw_deg", "sigma_xy", "sigma_z", "sigma_yaw_deg"};

/// The columns of the header, which names those that are known, and no others.
std::map<std::string_view, std::size_t> columns_of(const fs::path& file, std::string header) {
  if (header.starts_with("\xEF\xBB\xBF")) header.erase(0, 3);
  std::map<std::string_view, std::size_t> columns;
  const std::vector<std::string_view> cells = split(header, ',');
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto name = std::find(column_names.begin(), column_names.end(), cells[i]);
    if (name == column_names.end() || !columns.emplace(*name, i).second)
      throw file_error(file, "has the header \"" + header + "\"",
                       "The columns are scan,x,y,z,yaw_deg,sigma_xy,sigma_z,sigma_yaw_deg.");
  }
  if (!columns.contains("scan"))
    throw file_error(file, "has no column scan", "Name the scan of each line, as in poses.csv.");
  return columns;
}

/// A line of the table.
struct table_row {
  const fs::path& file;
  const std::map<std::string_view, std::size_t>& columns;
  const std::vector<std::string_view>& cells;
  std::size_t line;

  std::string text(std::string_view column) const {
    const auto found = columns.find(column);
    if (found == columns.end() || found->second >= cells.size()) return "";
    return std::string(cells[found->second]);
  }
  [[noreturn]] void fail(const std::string& problem) const {
    throw file_error(file, "line " + std::to_string(line) + ": " + problem,
                     "Write a number, or leave the field empty where nothing is known.");
  }
  /// Not a number where the cell is empty.
  double number(std::string_view column) const {
    const std::string cell = text(column);
    if (cell.empty()) return std::numeric_limits<double>::quiet_NaN();
    const auto value = to_number(cell);
    if (!value || !std::isfinite(*value)) fail("\"" + cell + "\" in column " + std::string(column));
    return *value;
  }
  /// The standard deviation of something, which is needed where that is known.
  double sigma(std::string_view column, bool is_needed) const {
    const double value = number(column);
    if (is_needed && !(value > 0)) fail(std::string(column) + " must be a positive number");
    return is_needed ? value : 1;
  }
};

named_prior prior_of(const table_row& row) {
  constexpr double degree = std::numbers::pi / 180;
  named_prior prior;
  prior.scan = row.text("scan");
  survey_options::prior& p = prior.measured;
  p.position = {row.number("x"), row.number("y"), row.number("z")};
  if (std::isnan(p.position.x()) != std::isnan(p.position.y())) row.fail("x and y are known both or neither");
  p.yaw = row.number("yaw_deg") * degree;
  p.sigma_plan = row.sigma("sigma_xy", !std::isnan(p.position.x()));
  p.sigma_height = row.sigma("sigma_z", !std::isnan(p.position.z()));
  p.sigma_yaw = row.sigma("sigma_yaw_deg", !std::isnan(p.yaw)) * degree;
  return prior;
}

}  // namespace

std::vector<named_prior> read_priors(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  if (!in || !std::getline(in, line))
    throw file_error(file, "cannot be read, or is empty", "Check its path.");
  const auto columns = columns_of(file, line);
  std::vector<named_prior> priors;
  for (std::size_t number = 2; std::getline(in, line); ++number) {
    const std::vector<std::string_view> cells = split(line, ',');
    const table_row row{file, columns, cells, number};
    if (cells.size() > columns.size()) row.fail("there are more fields than columns");
    if (!row.text("scan").empty())
      priors.push_back(prior_of(row));
    else if (std::any_of(cells.begin(), cells.end(), [](const auto& cell) { return !cell.empty(); }))
      row.fail("the scan has no name");
  }
  return priors;
}

}  // namespace globalmatch::support

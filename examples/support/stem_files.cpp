#include "support/stem_files.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <string_view>

#include "support/atomic_file.hpp"
#include "support/input_file.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

// Where the columns are that matter.
struct stem_columns {
  char separator;
  std::size_t count;
  std::size_t x, y;
  std::optional<std::size_t> z, radius, dbh;
};

std::optional<std::size_t> find_column(const std::vector<std::string_view>& names, std::string_view name) {
  const auto found = std::find_if(names.begin(), names.end(),
                                  [name](std::string_view other) { return lower_case(other) == name; });
  if (found == names.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names.begin());
}

stem_columns read_header(input_file& file) {
  constexpr std::string_view remedy = "The first line names the columns, e.g.: x,y,z,radius";
  const auto line = file.read_line();
  if (!line) file.fail("is empty", remedy);
  const char separator = separator_of(*line);
  const std::vector<std::string_view> names = split(*line, separator);
  const auto x = find_column(names, "x");
  const auto y = find_column(names, "y");
  if (!x || !y) file.fail_at_line(std::string("names no column ") + (x ? "y" : "x"), remedy);
  return {separator,
          names.size(),
          *x,
          *y,
          find_column(names, "z"),
          find_column(names, "radius"),
          find_column(names, "dbh")};
}

std::string quoted(std::string_view field) {
  return "'" + std::string(field.substr(0, 40)) + "'";
}

double coordinate(const input_file& file, std::string_view field, std::string_view column) {
  const auto value = to_number(field);
  if (!value || !std::isfinite(*value))
    file.fail_at_line("has " + quoted(field) + " in column " + std::string(column),
                      "Write a number there, like 12.5, or remove the line");
  return *value;
}

double length_if_known(const input_file& file, std::string_view field, std::string_view column) {
  if (field.empty() || field == "NA") return std::numeric_limits<double>::quiet_NaN();
  const auto value = to_number(field);
  if (!value || std::isinf(*value) || *value < 0)
    file.fail_at_line("has " + quoted(field) + " in column " + std::string(column),
                      "Write a length in metres there, or leave the field empty");
  return *value;
}

stem_record parse_stem(const input_file& file, std::string_view line, const stem_columns& columns) {
  const std::vector<std::string_view> fields = split(line, columns.separator);
  if (fields.size() != columns.count)
    file.fail_at_line("has " + std::to_string(fields.size()) + " fields, but the header names " +
                          std::to_string(columns.count),
                      "Mend the line; numbers have decimal points, and text with separators is quoted");
  stem_record stem;
  stem.x = coordinate(file, fields[columns.x], "x");
  stem.y = coordinate(file, fields[columns.y], "y");
  if (columns.z) stem.z = coordinate(file, fields[*columns.z], "z");
  if (columns.radius)
    stem.radius = length_if_known(file, fields[*columns.radius], "radius");
  else if (columns.dbh)
    stem.radius = length_if_known(file, fields[*columns.dbh], "dbh") / 2;
  return stem;
}

void write_field(std::ostream& out, double value) {
  out << ',';
  if (!std::isnan(value)) out << value;
}

}  // namespace

stem_table read_stems(const std::filesystem::path& path) {
  input_file file(path);
  const stem_columns columns = read_header(file);
  stem_table table;
  table.has_heights = columns.z.has_value();
  table.has_radii = columns.radius || columns.dbh;
  while (const auto line = file.read_line())
    if (!trim(*line).empty()) table.stems.push_back(parse_stem(file, *line, columns));
  return table;
}

void write_stems(const std::filesystem::path& path, std::span<const stem_record> stems,
                 std::span<const stem_column> further) {
  for (const stem_column& column : further)
    if (column.values.size() != stems.size())
      throw std::invalid_argument("write_stems: column " + column.name + " has not one value for each stem");
  atomic_file file(path);
  std::ostream& out = file.stream();
  out << "x,y,z,radius";
  for (const stem_column& column : further) out << ',' << column.name;
  out << '\n';
  for (std::size_t i = 0; i < stems.size(); ++i) {
    out << stems[i].x << ',' << stems[i].y << ',' << stems[i].z;
    write_field(out, stems[i].radius);
    for (const stem_column& column : further) write_field(out, column.values[i]);
    out << '\n';
  }
  file.commit();
}

}  // namespace globalmatch::support

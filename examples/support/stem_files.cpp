#include "support/stem_files.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <string_view>

#include "support/atomic_file.hpp"
#include "support/input_file.hpp"
#include "support/table.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

// Numbers that stand for an unknown length: a coordinate may well be -99.
bool says_unknown_length(const table_reader& table, std::size_t column) {
  const auto value = table.number_as_written(column);
  return table.says_unknown(column) || (value && (*value == -999 || *value == -99));
}

// The coordinate in a cell; nothing where it is not known.
std::optional<double> coordinate(const table_reader& table, std::size_t column, std::string_view name) {
  const std::string_view cell = table.cells()[column];
  if (table.says_unknown(column)) return std::nullopt;
  const auto value = table.number(column);
  if (!value || !std::isfinite(*value))
    table.fail_at_row("has " + quoted(cell) + " in column " + std::string(name),
                      "Write a number there, like 12.5, or remove the line");
  return *value;
}

double length_if_known(const table_reader& table, std::size_t column, std::string_view name) {
  const std::string_view cell = table.cells()[column];
  if (says_unknown_length(table, column)) return std::numeric_limits<double>::quiet_NaN();
  const auto value = table.number(column);
  if (!value || std::isinf(*value) || *value < 0)
    table.fail_at_row("has " + quoted(cell) + " in column " + std::string(name),
                      "Write a length in metres there, or leave the field empty");
  return *value;
}

// Whether the current row is a note, as of means below a table: it has no numbers where x and y are.
bool is_note(const table_reader& table, const known_columns& columns) {
  const bool x = table.number(*columns.x).has_value(), y = table.number(*columns.y).has_value();
  return !x && !y && (table.says_unknown(*columns.x) || table.says_unknown(*columns.y));
}

// Radii or diameters that no tree has in metres are in centimetres, or in millimetres if no tree has them so.
double unit_of_size(std::vector<double> lengths, double max_usual, double max_tree) {
  std::erase_if(lengths, [](double length) { return std::isnan(length); });
  if (lengths.empty()) return 1;
  const auto middle = lengths.begin() + std::ptrdiff_t(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  if (*middle <= max_usual) return 1;
  return *std::max_element(lengths.begin(), lengths.end()) <= 100 * max_tree ? 0.01 : 0.001;
}

void note_unit(stem_table& table, std::string_view column, double unit) {
  if (unit != 1)
    table.notes.push_back("column " + std::string(column) + " is taken for " +
                          (unit == 0.01 ? "centimetres" : "millimetres") +
                          ": its values are larger than trees are in metres");
}

// Heights count if all stems have them.
void use_heights_if_complete(stem_table& table, std::size_t with_height, bool has_column) {
  const std::size_t stems = table.stems.size();
  table.has_heights = has_column && with_height == stems;
  if (!has_column || table.has_heights) return;
  for (stem_record& stem : table.stems) stem.z = 0;
  table.notes.push_back("z is missing in " + std::to_string(stems - with_height) + " of " +
                        std::to_string(stems) + " rows: heights are not used");
}

// From what the column holds, radii or diameters in any unit.
void make_radii(stem_table& table, bool are_radii) {
  constexpr double max_usual_radius = 1, max_radius = 1.5;  // [m] the median of a stand, and of any tree
  const double to_radius = are_radii ? 1 : 0.5;
  std::vector<double> radii;
  for (const stem_record& stem : table.stems) radii.push_back(to_radius * stem.radius);
  const double unit = unit_of_size(radii, max_usual_radius, max_radius);
  note_unit(table, are_radii ? "radius" : "dbh", unit);
  for (stem_record& stem : table.stems) stem.radius *= to_radius * unit;
}

void write_field(std::ostream& out, double value) {
  out << ',';
  if (!std::isnan(value)) out << value;
}

}  // namespace

stem_table read_stems(const std::filesystem::path& path) {
  input_file file(path);
  table_reader rows(file, table_of::stems);
  const known_columns& columns = rows.columns();
  stem_table table;
  table.has_radii = columns.radius || columns.diameter;
  std::size_t without_place = 0, with_height = 0;
  while (rows.next()) {
    if (is_note(rows, columns)) {
      ++without_place;
      continue;
    }
    const auto x = coordinate(rows, *columns.x, "x"), y = coordinate(rows, *columns.y, "y"),
               z = columns.z ? coordinate(rows, *columns.z, "z") : std::nullopt;
    if (!x || !y) {
      ++without_place;
      continue;
    }
    with_height += z.has_value();
    stem_record stem{*x, *y, z.value_or(0)};
    if (columns.radius)
      stem.radius = length_if_known(rows, *columns.radius, "radius");
    else if (columns.diameter)
      stem.radius = length_if_known(rows, *columns.diameter, "dbh");
    table.stems.push_back(stem);
  }
  if (table.stems.empty() && without_place > 0)
    file.fail("has no row with x and y", "Write their coordinates in metres there");
  use_heights_if_complete(table, with_height, columns.z.has_value());
  if (table.has_radii) make_radii(table, columns.radius.has_value());
  if (without_place > 0)
    table.notes.push_back(std::to_string(without_place) + " rows without x and y are left out");
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

// Text scans: one point a line, as XYZ, CSV, TXT and PTS files have them.
#include <algorithm>
#include <array>
#include <optional>
#include <string>

#include "support/scan_formats.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

constexpr std::string_view remedy =
    "A text scan has a point a line, x y z first or named by a header; other known formats are PLY, PCD and "
    "LAS";

// What stands above the points.
struct text_start {
  std::optional<std::string> comment;      ///< the last one: it may name the columns
  std::optional<std::string> names;        ///< a header line that is no comment
  std::optional<std::uint64_t> announced;  ///< a line with only the number of points
  std::optional<std::string> first_point;  ///< the line; empty when there is none
};

// The text of a comment; empty when the line is none.
std::optional<std::string_view> comment_of(std::string_view line) {
  if (line.starts_with('#')) return trim(line.substr(1));
  if (line.starts_with("//")) return trim(line.substr(2));
  return std::nullopt;
}

// Whether some field is a number or, like 1,5, was meant to be one: such a line is no header.
bool looks_numeric(const std::vector<std::string_view>& fields) {
  return std::any_of(fields.begin(), fields.end(), [](std::string_view field) {
    return to_number(field) || field.find_first_of("+-.0123456789") == 0;
  });
}

text_start read_start(input_file& file) {
  text_start start;
  while (const auto raw = file.read_line()) {
    const std::string_view line = trim(*raw);
    if (line.empty()) continue;
    const std::vector<std::string_view> fields = split(line, separator_of(line));
    if (const auto comment = comment_of(line)) {
      start.comment = *comment;
    } else if (fields.size() == 1 && to_count(fields[0]) && !start.announced && !start.names) {
      start.announced = to_count(fields[0]);
    } else if (!looks_numeric(fields)) {
      if (start.names) file.fail_at_line("holds no numbers", remedy);
      start.names = line;
    } else {
      start.first_point = line;
      return start;
    }
  }
  return start;
}

// The columns named x, y and z; empty when none is named so.
std::optional<std::array<std::size_t, 3>> named_columns(const input_file& file,
                                                        const std::vector<std::string_view>& names) {
  std::array<std::size_t, 3> columns = {};
  int found = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto named = std::find_if(names.begin(), names.end(), [axis](std::string_view name) {
      return lower_case(name) == std::string(1, "xyz"[axis]);
    });
    if (named == names.end()) continue;
    columns[axis] = static_cast<std::size_t>(named - names.begin());
    ++found;
  }
  if (found == 0) return std::nullopt;
  if (found < 3) file.fail("has a header that names some, but not all, of the columns x, y and z", remedy);
  return columns;
}

// The names of the columns. A comment counts, as CloudCompare writes it, if it has a name for each column.
std::vector<std::string_view> column_names(const text_start& start, std::size_t column_count) {
  if (start.names) return split(*start.names, separator_of(*start.names));
  if (!start.comment) return {};
  const std::vector<std::string_view> words = split(*start.comment, separator_of(*start.comment));
  return words.size() == column_count ? words : std::vector<std::string_view>{};
}

// Where x, y and z are: the first three columns unless there are names.
std::array<std::size_t, 3> columns_of(const input_file& file, const text_start& start, char separator) {
  const std::size_t column_count = split(*start.first_point, separator).size();
  const std::vector<std::string_view> names = column_names(start, column_count);
  const auto named = named_columns(file, names);
  if (named && names.size() != column_count)
    file.fail("has a header with " + std::to_string(names.size()) + " names above lines of " +
                  std::to_string(column_count) + " fields",
              remedy);
  return named.value_or(std::array<std::size_t, 3>{0, 1, 2});
}

std::vector<Eigen::Vector3d> no_points(const input_file& file, const text_start& start) {
  const bool empty_table =
      start.names && named_columns(file, split(*start.names, separator_of(*start.names)));
  const bool announced_empty = start.announced == 0u;
  if (!empty_table && !announced_empty) file.fail("holds no line of numbers", remedy);
  return {};
}

}  // namespace

std::vector<Eigen::Vector3d> read_text(input_file& file) {
  const std::uint64_t size = file.remaining();
  const text_start start = read_start(file);
  if (!start.first_point) return no_points(file, start);

  const char separator = separator_of(*start.first_point);
  const std::array<std::size_t, 3> columns = columns_of(file, start, separator);
  std::vector<Eigen::Vector3d> points = {read_columns(file, *start.first_point, separator, columns)};
  while (const auto raw = file.read_line()) {
    const std::string_view line = trim(*raw);
    if (line.empty() || comment_of(line)) continue;
    points.push_back(read_columns(file, line, separator, columns));
    // Lines are about equally long: room for all of them at once spares the copies of a growing vector.
    constexpr std::size_t sample = 1000;
    if (points.size() == sample)
      points.reserve(sample + size / ((size - file.remaining()) / sample) * 21 / 20);
  }
  if (start.announced > points.size())
    file.fail("announces " + std::to_string(*start.announced) + " points but holds " +
                  std::to_string(points.size()),
              "It is probably truncated: copy or export it again");
  return points;
}

}  // namespace globalmatch::support

// The PTX format of Leica: the columns and rows of a scan, its pose in ten lines less two, and a point a
// line, also for rays that returned nothing.
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "support/scan_formats.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

// Numbers in each line of the header: columns, rows, the scanner's position and axes, a matrix.
constexpr std::array<std::size_t, 10> header = {1, 1, 3, 3, 3, 3, 4, 4, 4, 4};
constexpr std::string_view export_again = "Export the scan again as PTX, PLY, LAS or text (x y z)";

// The numbers of a line; nothing where it has others, or something else.
bool holds_numbers(std::string_view line, std::size_t count) {
  const std::vector<std::string_view> words = split(line, ' ');
  if (words.size() != count) return false;
  for (const std::string_view word : words)
    if (!(count == 1 ? to_count(word).has_value() : to_number(word).has_value())) return false;
  return true;
}

std::uint64_t read_count(input_file& file) {
  const auto line = file.read_line();
  const auto count = line ? to_count(trim(*line)) : std::nullopt;
  if (!count) file.fail_at_line("is no count of a PTX header", export_again);
  return *count;
}

}  // namespace

bool looks_like_ptx(std::string_view start) {
  for (const std::size_t count : header) {
    const std::size_t end = start.find_first_of("\r\n");
    if (end == std::string_view::npos || !holds_numbers(start.substr(0, end), count)) return false;
    start.remove_prefix(end + (start.substr(end).starts_with("\r\n") ? 2 : 1));
  }
  return true;
}

opened_scan open_ptx(input_file& file) {
  const std::uint64_t columns = read_count(file), rows = read_count(file);
  for (std::size_t i = 2; i < header.size(); ++i) file.read_line();
  constexpr std::uint64_t shortest_line = 6;  // three digits, two blanks and an end, which the last may lack
  if (rows > 0 && columns > (file.remaining() + 1) / shortest_line / rows) file.fail_truncated();
  std::vector<Eigen::Vector3d> points;
  for (std::uint64_t left = rows * columns; left > 0; --left) {
    const auto line = file.read_line();
    if (!line) file.fail_truncated();
    const Eigen::Vector3d p = read_columns(file, *line, ' ', {0, 1, 2});
    if (!p.isZero(0)) points.push_back(p);
  }
  while (const auto line = file.read_line())
    if (!trim(*line).empty())
      file.fail("holds several scans, or more points than it announces",
                "Export each scan to a file of its own");
  return {std::make_unique<points_in_memory>(std::move(points)), {.format = "PTX"}};
}

}  // namespace globalmatch::support

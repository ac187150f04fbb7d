#include "support/pts.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "support/announced_blocks.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

bool is_passed_over_in_pts(std::string_view line) {
  return line.empty() || line.starts_with('#') || line.starts_with("//");
}

// Calls `use_count` for each count that begins a block, and `use_row` for each line of points.
template <class UseCount, class UseRow>
void walk(input_file& file, const UseCount& use_count, const UseRow& use_row) {
  while (const auto line = file.read_line()) {
    const std::string_view text = trim(*line);
    if (is_passed_over_in_pts(text)) continue;
    if (const auto count = to_count(text))
      use_count(*count);
    else
      use_row(text);
  }
}

}  // namespace

bool looks_like_pts(std::string_view start) {
  std::size_t lines = 0;
  while (lines < 2 && !start.empty()) {
    const std::size_t end = start.find_first_of("\r\n");
    if (end == std::string_view::npos) break;  // the line may go on
    const std::string_view line = trim(start.substr(0, end));
    start.remove_prefix(end + 1);
    if (is_passed_over_in_pts(line)) continue;
    if (++lines == 1 && !to_count(line)) return false;
    if (lines == 2) return to_count(line) || split(line, separator_of(line)).size() >= 3;
  }
  return false;
}

opened_scan open_pts(input_file& file, std::size_t number, const scan_options& options) {
  opened_scan opened;
  std::vector<Eigen::Vector3d> points;
  attribute_table attributes;
  std::size_t block = 0;
  std::uint64_t announced = 0;
  char separator = ' ';
  walk(
      file,
      [&](std::uint64_t count) {
        if (++block == number) announced = count;
      },
      [&](std::string_view row) {
        if (block == 0) file.fail_at_line("is no count of points", "A PTS file begins with one");
        if (block != number) return;
        if (points.empty()) {
          separator = separator_of(row);
          opened.header.attributes = names_behind_xyz(split(row, separator).size());
          if (options.attributes) attributes = attribute_table::of_names(opened.header.attributes);
        }
        points.push_back(read_columns(file, row, separator, {0, 1, 2}));
        read_behind_xyz(row, separator, attributes.attributes().size(),
                        [&](std::size_t k, double value) { attributes.append(k, value); });
      });
  if (number == 0 || number > block)
    file.fail("holds " + std::to_string(block) + " blocks of points, and no block " + std::to_string(number),
              "Blocks are counted from 1");
  require_as_announced(file, number, announced, points.size());
  opened.header.format = "PTS";
  if (block > 1) opened.header.format += ", scan " + std::to_string(number) + " of " + std::to_string(block);
  opened.points = std::make_unique<points_in_memory>(std::move(points), std::move(attributes));
  return opened;
}

}  // namespace globalmatch::support

#include "support/pts.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "support/input_file.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

bool is_passed_over(std::string_view line) {
  return line.empty() || line.starts_with('#') || line.starts_with("//");
}

// Calls `use_count` for each count that begins a block, and `use_row` for each line of points.
template <class UseCount, class UseRow>
void walk(input_file& file, const UseCount& use_count, const UseRow& use_row) {
  while (const auto line = file.read_line()) {
    const std::string_view text = trim(*line);
    if (is_passed_over(text)) continue;
    if (const auto count = to_count(text))
      use_count(*count);
    else
      use_row(text);
  }
}

void require_as_announced(const input_file& file, std::size_t number, std::uint64_t announced,
                          std::uint64_t rows) {
  if (rows == announced) return;
  file.fail("has a block " + std::to_string(number) + " that announces " + std::to_string(announced) +
                " points but holds " + std::to_string(rows),
            rows < announced ? "It is probably truncated: copy or export it again"
                             : "Export it again, or correct the count");
}

}  // namespace

bool looks_like_pts(std::string_view start) {
  std::size_t lines = 0;
  while (lines < 2 && !start.empty()) {
    const std::size_t end = start.find_first_of("\r\n");
    if (end == std::string_view::npos) break;  // the line may go on
    const std::string_view line = trim(start.substr(0, end));
    start.remove_prefix(end + 1);
    if (is_passed_over(line)) continue;
    if (++lines == 1 && !to_count(line)) return false;
    if (lines == 2) return to_count(line) || split(line, separator_of(line)).size() >= 3;
  }
  return false;
}

void require_announced_blocks(const std::filesystem::path& path) {
  input_file file(path);
  std::size_t blocks = 0;
  std::uint64_t announced = 0, rows = 0;
  walk(
      file,
      [&](std::uint64_t count) {
        if (blocks++ > 0) require_as_announced(file, blocks - 1, announced, rows);
        announced = count;
        rows = 0;
      },
      [&](std::string_view) { ++rows; });
  if (blocks > 1) require_as_announced(file, blocks, announced, rows);
}

opened_scan open_pts(const std::filesystem::path& path, std::size_t number, const scan_options& options) {
  input_file file(path);
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

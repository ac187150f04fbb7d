// Text scans: one point a line, as XYZ, CSV, TXT and PTS files have them.
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "support/scan_formats.hpp"
#include "support/table.hpp"

namespace globalmatch::support {

namespace {

Eigen::Vector3d point_of(const table_reader& table) {
  const known_columns& columns = table.columns();
  const std::size_t of_axis[3] = {*columns.x, *columns.y, *columns.z};
  Eigen::Vector3d p;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const std::size_t column = of_axis[axis];
    const auto value = table.number(column);
    if (!value && column >= table.cells().size())
      table.fail_at_row(
          "has only " + std::to_string(table.cells().size()) + " fields, but x, y and z are needed",
          "Mend or remove that line");
    if (!value)
      table.fail_at_row(
          "has '" + std::string(table.cells()[column].substr(0, 40)) + "' where a number is expected",
          "Numbers are written like 12.5 or -1.25e1");
    p[axis] = *value;
  }
  return p;
}

}  // namespace

opened_scan open_text(input_file& file) {
  const std::uint64_t size = file.remaining();
  table_reader table(file, table_of::points);
  std::vector<Eigen::Vector3d> points;
  while (table.next()) {
    points.push_back(point_of(table));
    // Lines are about equally long: room for all of them at once spares the copies of a growing vector.
    constexpr std::size_t sample = 1000;
    if (points.size() == sample)
      points.reserve(sample + size / ((size - file.remaining()) / sample) * 21 / 20);
  }
  if (points.empty() && !table.has_header() && table.announced() != 0u)
    file.fail("holds no line of numbers",
              "A text scan has a point a line, x y z first or named by a header; other "
              "known formats are PLY, PCD, LAS, LAZ, E57 and PTX");
  if (table.announced() > points.size())
    file.fail("announces " + std::to_string(*table.announced()) + " points but holds " +
                  std::to_string(points.size()),
              "It is probably truncated: copy or export it again");
  return {std::make_unique<points_in_memory>(std::move(points)), {.format = "text"}};
}

}  // namespace globalmatch::support

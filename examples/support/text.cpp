// Text scans: one point a line, as XYZ, CSV, TXT and PTS files have them.
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "support/scan_formats.hpp"
#include "support/table.hpp"

namespace globalmatch::support {

namespace {

// Whether numbers of a row say that its place is not known: z, or x and y. A local grid may well pass through
// -9999 along one axis of its plane.
bool say_unknown(const Eigen::Vector3d& written) {
  return is_unknown_number(written.z()) || (is_unknown_number(written.x()) && is_unknown_number(written.y()));
}

// The point of a row; not-a-number where its place is not known.
Eigen::Vector3d point_of(const table_reader& table) {
  const known_columns& columns = table.columns();
  const std::size_t of_axis[3] = {*columns.x, *columns.y, *columns.z};
  const Eigen::Vector3d nowhere = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  Eigen::Vector3d written, units;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const std::size_t column = of_axis[axis];
    const auto value = table.number_as_written(column);
    if (!value && column >= table.cells().size())
      table.fail_at_row(
          "has only " + std::to_string(table.cells().size()) + " fields, but x, y and z are needed",
          "Mend or remove that line");
    if (!value && !table.cells()[column].empty() && table.says_unknown(column)) return nowhere;
    if (!value)
      table.fail_at_row(
          "has '" + std::string(table.cells()[column].substr(0, 40)) + "' where a number is expected",
          "Numbers are written like 12.5 or -1.25e1");
    written[axis] = *value;
    units[axis] = columns.units[column];
  }
  return say_unknown(written) ? nowhere : written.cwiseProduct(units);
}

/// The columns besides x, y and z.
class text_attributes {
 public:
  /// Of a table whose first row was read.
  explicit text_attributes(const table_reader& table) {
    const std::size_t cells = table.has_header() ? table.names().size() : table.cells().size();
    const std::vector<std::string> guessed = names_behind_xyz(cells);
    const known_columns& columns = table.columns();
    std::vector<std::string> names;
    for (std::size_t k = 0; k < cells; ++k) {
      if (k == *columns.x || k == *columns.y || k == *columns.z) continue;
      names.push_back(table.has_header() ? table.names()[k] : guessed[k - 3]);
      columns_.push_back(k);
    }
    table_ = attribute_table::of_names(names);
  }

  void append(const table_reader& table) {
    for (std::size_t k = 0; k < columns_.size(); ++k)
      table_.append(k, table.number(columns_[k]).value_or(std::numeric_limits<double>::quiet_NaN()));
  }

  attribute_table&& take() { return std::move(table_); }

 private:
  std::vector<std::size_t> columns_;
  attribute_table table_;
};

}  // namespace

opened_scan open_text(input_file& file, const scan_options& options) {
  const std::uint64_t size = file.remaining();
  table_reader table(file, table_of::points);
  if (options.attributes) table.keep_all_cells();
  std::vector<Eigen::Vector3d> points;
  std::optional<text_attributes> attributes;
  std::size_t without_place = 0;
  while (table.next()) {
    points.push_back(point_of(table));
    without_place += points.back().hasNaN();
    if (options.attributes && !attributes) attributes.emplace(table);
    if (attributes) attributes->append(table);
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
  opened_scan scan{std::make_unique<points_in_memory>(std::move(points),
                                                      attributes ? attributes->take() : attribute_table()),
                   {.format = "text"}};
  if (without_place > 0)
    scan.header.notes.push_back(std::to_string(without_place) +
                                " rows have no known x, y and z, and are passed over");
  return scan;
}

}  // namespace globalmatch::support

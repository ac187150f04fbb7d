// The PTX format of Leica: for each scan its columns and rows, its pose in ten lines less two, and a point a
// line, also for rays that returned nothing.
#include "support/ptx.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "support/input_file.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

// Numbers in each line of the header: columns, rows, the scanner's position and axes, a matrix.
constexpr std::array<std::size_t, 10> header = {1, 1, 3, 3, 3, 3, 4, 4, 4, 4};
constexpr std::size_t first_of_pose = 2, first_of_matrix = 6;
constexpr std::string_view export_again = "Export the scan again as PTX, E57, PLY, LAS or text (x y z)";

struct ptx_header {
  std::uint64_t points = 0;
  std::optional<Eigen::Isometry3d> pose;
  Eigen::Isometry3d scanner = Eigen::Isometry3d::Identity();  // as its place and axes say
  std::uint64_t begin_of_pose = 0;                            // bytes, of its eight lines
};

// The numbers of a line; nothing where it has others, or something else.
std::optional<Eigen::Vector4d> numbers_in(std::string_view line, std::size_t count) {
  const std::vector<std::string_view> words = split(line, ' ');
  if (words.size() != count) return std::nullopt;
  Eigen::Vector4d numbers = Eigen::Vector4d::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    const auto number = to_number(words[i]);
    if (!number || (count == 1 && !to_count(words[i]))) return std::nullopt;
    numbers[static_cast<Eigen::Index>(i)] = *number;
  }
  return numbers;
}

// PTX multiplies rows by its matrix, so it has the transposed one, with the translation in the last row.
std::optional<Eigen::Isometry3d> pose_of(const Eigen::Matrix4d& rows) {
  const Eigen::Matrix4d matrix = rows.transpose();
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  constexpr double rounding = 1e-4;  // of axes with six decimals, and of single precision
  const double error = (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!matrix.allFinite() || !(error <= rounding) || rotation.determinant() < 0) return std::nullopt;
  if (!matrix.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1))) return std::nullopt;
  return Eigen::Translation3d(matrix.topRightCorner<3, 1>()) * Eigen::Quaterniond(rotation).normalized();
}

bool is_passed_over_in_ptx(std::string_view line) {
  return line.empty() || line.starts_with('#');
}

// The header of the next scan; nothing at the end of the file.
std::optional<ptx_header> read_header(input_file& file, bool with_offset = false) {
  auto line = file.read_line();
  while (line && is_passed_over_in_ptx(trim(*line))) line = file.read_line();
  if (!line) return std::nullopt;
  std::uint64_t sizes[2] = {};
  Eigen::Matrix4d matrix;
  ptx_header scan;
  for (std::size_t i = 0; i < header.size(); ++i) {
    if (i == first_of_pose && with_offset) scan.begin_of_pose = file.offset();
    if (i > 0) line = file.read_line();
    if (!line) file.fail_truncated();
    const auto numbers = numbers_in(*line, header[i]);
    if (!numbers)
      file.fail_at_line(
          "has other than the numbers (" + std::to_string(header[i]) +
              ") of this line of a PTX header: a scan has more points than it announces, or is damaged",
          export_again);
    if (i < 2) sizes[i] = *to_count(trim(*line));
    if (i >= first_of_matrix)
      matrix.row(static_cast<Eigen::Index>(i - first_of_matrix)) = *numbers;
    else if (i > first_of_pose)
      scan.scanner.linear().col(static_cast<Eigen::Index>(i - first_of_pose - 1)) = numbers->head<3>();
    else if (i == first_of_pose)
      scan.scanner.translation() = numbers->head<3>();
  }
  constexpr std::uint64_t shortest_line = 6;  // three digits, two blanks and an end, which the last may lack
  if (sizes[1] > 0 && sizes[0] > (file.remaining() + 1) / shortest_line / sizes[1]) file.fail_truncated();
  scan.points = sizes[0] * sizes[1];
  scan.pose = pose_of(matrix);
  return scan;
}

std::string_view read_row(input_file& file) {
  const auto line = file.read_line();
  if (!line) file.fail_truncated();
  return *line;
}

opened_scan read_points(input_file& file, const ptx_header& scan, bool with_attributes) {
  opened_scan opened;
  attribute_table attributes;
  std::vector<Eigen::Vector3d> points;
  for (std::uint64_t i = 0; i < scan.points; ++i) {
    const std::string_view line = read_row(file);
    if (i == 0) {
      const std::size_t fields = split(line, ' ').size();
      if (fields >= 4) opened.header.attributes.emplace_back("intensity");
      if (fields >= 7)
        opened.header.attributes.insert(opened.header.attributes.end(), {"red", "green", "blue"});
      if (with_attributes) attributes = attribute_table::of_names(opened.header.attributes);
    }
    const Eigen::Vector3d p = read_columns(file, line, ' ', {0, 1, 2});
    if (p.isZero(0)) continue;
    points.push_back(p);
    read_behind_xyz(line, ' ', attributes.attributes().size(),
                    [&](std::size_t k, double value) { attributes.append(k, value); });
  }
  opened.header.pose = scan.pose;
  if (!scan.pose)
    opened.header.notes.emplace_back(
        "the matrix in its header is no rotation and translation, and not known as a pose: programs that "
        "apply it, as CloudCompare and PDAL do, show the scan elsewhere");
  opened.points = std::make_unique<points_in_memory>(std::move(points), std::move(attributes));
  return opened;
}

}  // namespace

bool looks_like_ptx(std::string_view start) {
  std::size_t i = 0;
  while (i < first_of_matrix) {
    const std::size_t end = start.find_first_of("\r\n");
    if (end == std::string_view::npos) return false;
    const std::string_view line = trim(start.substr(0, end));
    start.remove_prefix(end + 1);
    if (is_passed_over_in_ptx(line)) continue;
    const auto numbers = numbers_in(line, header[i]);
    constexpr std::size_t first_axis = 3;
    constexpr double rounding = 0.01;
    if (!numbers || (i >= first_axis && std::abs(numbers->norm() - 1) > rounding)) return false;
    ++i;
  }
  return true;
}

std::size_t count_ptx_scans(input_file& file) {
  std::size_t count = 0;
  while (const auto scan = read_header(file)) {
    for (std::uint64_t i = 0; i < scan->points; ++i) read_row(file);
    ++count;
  }
  return count;
}

namespace {

[[noreturn]] void fail_without_scan(const input_file& file, std::size_t count, std::size_t number) {
  file.fail("holds " + std::to_string(count) + " scans, and no scan " + std::to_string(number),
            "Scans are counted from 1");
}

// What ends the line that ends before `offset`.
std::string_view line_end_before(const file_bytes& file, std::uint64_t offset) {
  std::array<char, 2> last;
  file.read(offset - 2, last);
  if (last[1] == '\r') return "\r";
  return last[0] == '\r' ? "\r\n" : "\n";
}

// The scanner's place and axes, and the matrix.
void write_ptx_pose(const Eigen::Isometry3d& scanner, const Eigen::Isometry3d& survey_from_file,
                    std::string_view line_end, std::ostream& out) {
  const auto write = [&](const auto& numbers) {
    for (Eigen::Index i = 0; i < numbers.size(); ++i) out << (i > 0 ? " " : "") << numbers[i];
    out << line_end;
  };
  write(scanner.translation());
  for (int axis = 0; axis < 3; ++axis) write(scanner.linear().col(axis));
  for (int row = 0; row < 4; ++row) write(survey_from_file.matrix().col(row));
}

}  // namespace

opened_scan open_ptx(input_file& file, std::size_t number, const scan_options& options) {
  opened_scan opened;
  std::size_t count = 0;
  while (const auto scan = read_header(file)) {
    if (++count == number)
      opened = read_points(file, *scan, options.attributes);
    else
      for (std::uint64_t i = 0; i < scan->points; ++i) read_row(file);
  }
  if (!opened.points) fail_without_scan(file, count, number);
  opened.scans = count;
  opened.header.format = "PTX";
  if (count > 1) opened.header.format += ", scan " + std::to_string(number) + " of " + std::to_string(count);
  return opened;
}

void write_ptx_with_poses(input_file& file, std::span<const scan_pose> poses, std::ostream& out) {
  std::size_t count = 0, last = 0;
  for (const scan_pose& pose : poses) last = std::max(last, pose.number);
  std::uint64_t copied = 0;  // [bytes]
  while (count < last) {
    const auto scan = read_header(file, true);
    if (!scan) fail_without_scan(file, count, last);
    ++count;
    const std::uint64_t end_of_header = file.offset();
    for (std::uint64_t i = 0; count < last && i < scan->points; ++i) read_row(file);
    const auto pose =
        std::find_if(poses.begin(), poses.end(), [&](const scan_pose& p) { return p.number == count; });
    if (pose == poses.end()) continue;
    const Eigen::Isometry3d& survey_from_file = pose->survey_from_file;
    const Eigen::Isometry3d scanner =
        scan->pose ? survey_from_file * scan->pose->inverse() * scan->scanner : survey_from_file;
    copy_bytes(file.bytes(), copied, scan->begin_of_pose, out);
    write_ptx_pose(scanner, survey_from_file, line_end_before(file.bytes(), scan->begin_of_pose), out);
    copied = end_of_header;
  }
  copy_bytes(file.bytes(), copied, file.bytes().size(), out);
}

}  // namespace globalmatch::support

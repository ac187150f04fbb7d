// The true stems of a plot, and the returns that each got in a scan.
#pragma once

#include "evaluated_scans.hpp"
#include "scan_names.hpp"
#include "support/file_error.hpp"
#include "support/input_file.hpp"
#include "support/stem_files.hpp"
#include "support/text_fields.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <unordered_map>
#include <vector>

namespace globalmatch::benchmarks {

/// A file of true stems: of a whole plot, in its frame, or of one scan in the scan's.
struct stem_truth_file {
  std::filesystem::path path;
  bool is_of_scan = false;
};

/// The file for a scan: NAME_stems.csv, stems_K.csv (K ends NAME) or stems.csv, true_stems.csv, trees.csv; or
/// what `given` says, in which {name} and {number} stand for the scan's.
inline std::optional<stem_truth_file> find_stem_truth(const std::filesystem::path& folder,
                                                      const std::string& name, const std::string& given) {
  const auto replaced = [](std::string text, const std::string& word, const std::string& meaning) {
    if (const std::size_t at = text.find(word); at != text.npos) text.replace(at, word.size(), meaning);
    return text;
  };
  const std::vector<std::string> usual = {"{name}_stems.csv", "stems_{number}.csv", "stems.csv",
                                          "true_stems.csv", "trees.csv"};
  for (const std::string& pattern : given.empty() ? usual : std::vector{given}) {
    const std::string file = replaced(replaced(pattern, "{name}", name), "{number}", trailing_number(name));
    std::error_code ignored;
    if (std::filesystem::is_regular_file(folder / file, ignored)) return {{folder / file, file != pattern}};
  }
  if (!given.empty())
    throw support::file_error(folder / given, "is not there", "Correct --stems: it is relative to the plot");
  return std::nullopt;
}

/// The column of a table whose name is one of these, row by row; nothing where there is none. Rows without a
/// number there are refused.
inline std::optional<std::vector<std::uint32_t>> read_counts(const std::filesystem::path& path,
                                                             const std::vector<std::string>& columns) {
  support::input_file file(path);
  std::optional<std::size_t> column;
  std::vector<std::uint32_t> counts;
  while (const auto line = file.read_line()) {
    if (support::trim(*line).empty()) continue;
    const auto cells = support::split(*line, support::separator_of(*line));
    if (!column) {
      const auto named = std::find_first_of(cells.begin(), cells.end(), columns.begin(), columns.end());
      if (named == cells.end()) return std::nullopt;
      column = std::size_t(named - cells.begin());
      continue;
    }
    const auto count = *column < cells.size() ? support::to_count(cells[*column]) : std::nullopt;
    if (!count) file.fail_at_line("has no count of returns", "Write one, or remove the column of returns");
    counts.push_back(static_cast<std::uint32_t>(*count));
  }
  return counts;
}

/// True stems as a file has them.
struct stem_truth {
  std::vector<Eigen::Vector3d> positions;  ///< frame of the plot
  std::vector<double> radii;               ///< [m] not-a-number where not known
  bool has_heights = false;
  std::optional<std::vector<std::uint32_t>> returns;  ///< in the scan; else they are to be counted
  bool is_of_plot = false;  ///< another scan of the plot has the same stems in the same order
};

inline stem_truth read_stem_truth(const stem_truth_file& file, const std::string& scan,
                                  const Eigen::Isometry3d& plot_from_scan) {
  stem_truth truth;
  const support::stem_table table = support::read_stems(file.path);
  truth.has_heights = table.has_heights;
  truth.is_of_plot = !file.is_of_scan;
  for (const support::stem_record& s : table.stems) {
    const Eigen::Vector3d position(s.x, s.y, s.z);
    truth.positions.push_back(file.is_of_scan ? plot_from_scan * position : position);
    truth.radii.push_back(s.radius);
  }
  const std::vector<std::string> columns =
      file.is_of_scan ? std::vector<std::string>{"returns"}
                      : std::vector{"returns_" + scan, "returns_" + trailing_number(scan)};
  truth.returns = read_counts(file.path, columns);
  if (truth.returns && truth.returns->size() != truth.positions.size())
    throw support::file_error(file.path, "has stems without x and y, but with returns",
                              "Write their positions, or remove them");
  return truth;
}

/// Counts the points on each stem 0.2 m to 3 m above its base, or at any height where that is not known: as
/// far from its axis as its radius and 5 cm, or 25 cm where the radius is not known.
template <class Points>
std::vector<std::uint32_t> count_returns(const Points& points, const Eigen::Isometry3d& plot_from_scan,
                                         const stem_truth& truth) {
  constexpr double from = 0.2, to = 3, around = 0.05, any_radius = 0.2, cell = 1;  // [m]
  const auto key = [](double x, double y) {
    return std::int64_t(std::floor(x / cell)) * (std::int64_t(1) << 32) + std::int64_t(std::floor(y / cell));
  };
  std::unordered_map<std::int64_t, std::vector<std::size_t>> cells;
  for (std::size_t s = 0; s < truth.positions.size(); ++s)
    for (const double dx : {-cell, 0.0, cell})
      for (const double dy : {-cell, 0.0, cell})
        cells[key(truth.positions[s].x() + dx, truth.positions[s].y() + dy)].push_back(s);
  std::vector<std::uint32_t> counts(truth.positions.size());
  for (const Eigen::Vector3d& point : points) {
    if (!point.allFinite()) continue;
    const Eigen::Vector3d p = plot_from_scan * point;
    const auto found = cells.find(key(p.x(), p.y()));
    if (found == cells.end()) continue;
    for (const std::size_t s : found->second) {
      const Eigen::Vector3d d = p - truth.positions[s];
      const double radius = std::isnan(truth.radii[s]) ? any_radius : truth.radii[s];
      const bool is_at_height = !truth.has_heights || (d.z() >= from && d.z() <= to);
      counts[s] += is_at_height && d.head<2>().norm() <= radius + around;
    }
  }
  return counts;
}

}  // namespace globalmatch::benchmarks

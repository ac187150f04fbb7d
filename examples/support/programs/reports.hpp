// What the example programs report of a run: JSON files, times by stage.
#pragma once

#include <globalmatch/execution.hpp>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "support/progress_bar.hpp"
#include "support/scan_files.hpp"
#include "support/stem_files.hpp"
#include "support/warnings.hpp"

namespace globalmatch {
struct stem_map;
struct matching;
}  // namespace globalmatch

namespace globalmatch::support {

struct marked_points;

/// Times the stages of a run by listening to its progress, and shows it on a terminal: a stage lasts from its
/// first report to that of the next one.
class stage_clock {
 public:
  /// To be passed to the library; refers to this clock.
  execution listen(int threads);
  /// Ends the stage at work; what follows belongs to none until the next report.
  void leave();
  /// Seconds since construction.
  double seconds() const;
  /// Ends the stage at work. Seconds by stage, in the order they began.
  nlohmann::ordered_json stages();

 private:
  using clock = std::chrono::steady_clock;
  void enter(std::string_view stage);

  progress_bar bar_;
  clock::time_point start_ = clock::now(), last_ = start_;
  std::vector<std::pair<std::string, double>> stages_;
  std::optional<std::size_t> current_;
};

/// Points, stems and the funnel between them.
nlohmann::ordered_json describe(const stem_map& map);

/// Those of the map, after one of points that the file marks.
std::vector<warning> warnings_of(const stem_map& map, const marked_points& marked, bool keeps_marked);

/// The same of a scan that was mapped, after what is odd about its file.
std::vector<warning> warnings_of(const stem_map& map, const scan_file& scan, bool keeps_marked);

/// Of what was understood of the file of a stem map.
std::vector<warning> warnings_of(const stem_table& table);

/// To standard error, a line each.
void print(const std::vector<warning>& warnings);

/// To standard error, a line each, after the name of the scan.
void print(const std::vector<warning>& warnings, const std::filesystem::path& scan);

/// A list of `{code, text}`.
nlohmann::ordered_json describe(const std::vector<warning>& warnings);

/// Warns on standard error when the stems of a scan are clearly tilted.
void warn_if_tilted(const stem_map& map, const std::filesystem::path& scan);

/// The transform of the source as it was given: with the scale, where that was applied.
std::optional<Eigen::Isometry3d> with_scale(const matching& result);

/// Outcome, reason, transform, matches and ranked hypotheses.
nlohmann::ordered_json describe(const matching& result,
                                const std::optional<Eigen::Isometry3d>& target_from_source);

/// Writes nothing when `path` is empty. Throws `file_error`.
void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& report);

/// Writes the transform, or when there is none removes what an earlier run left there. Throws `file_error`.
void write_or_remove_transform(const std::filesystem::path& path,
                               const std::optional<Eigen::Isometry3d>& target_from_source);

/// One line about the outcome, for people.
std::string summary(const matching& result);

}  // namespace globalmatch::support

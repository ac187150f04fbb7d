// What the example programs tell about a run: JSON files, times by stage, the plan picture.
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

namespace globalmatch {
struct stem_map;
struct matching;
struct registration;
}  // namespace globalmatch

namespace globalmatch::support {

/// Times the stages of a run by listening to its progress.
class stage_clock {
 public:
  /// To be passed to the library; refers to this clock.
  execution listen(int threads);
  /// Leaves the time since the last stage out of all stages.
  void skip() { last_ = clock::now(); }
  /// Seconds since construction, and by stage in the order they began.
  double seconds() const;
  nlohmann::ordered_json stages() const;

 private:
  using clock = std::chrono::steady_clock;
  clock::time_point start_ = clock::now(), last_ = start_;
  std::vector<std::pair<std::string, double>> stages_;
};

/// Points, stems and the funnel between them.
nlohmann::ordered_json describe(const stem_map& map);

/// Outcome, reason, motion, matches and ranked hypotheses.
nlohmann::ordered_json describe(const matching& result,
                                const std::optional<Eigen::Isometry3d>& target_from_source);

/// Writes nothing when `path` is empty. Throws `file_error`.
void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& report);

/// Writes the motion, or when there is none removes what an earlier run left there. Throws `file_error`.
void write_or_remove_transform(const std::filesystem::path& path,
                               const std::optional<Eigen::Isometry3d>& target_from_source);

/// Draws both maps before and after, with the best hypothesis' correspondences. Throws `file_error`.
void write_report_picture(const std::filesystem::path& path, const stem_map& source, const stem_map& target,
                          const registration& result, std::string_view title);

/// One line about the outcome, for people.
std::string summary(const matching& result);

}  // namespace globalmatch::support

#include "support/programs/survey_files.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iostream>
#include <numbers>
#include <ostream>

#include "support/atomic_file.hpp"
#include "support/programs/reports.hpp"

namespace globalmatch::support {

namespace fs = std::filesystem;

namespace {

/// A field of a CSV table, in quotes where it needs them.
std::string field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + '"';
}

/// A number, or nothing where it is not finite.
struct known {
  double number;
  friend std::ostream& operator<<(std::ostream& out, const known& k) {
    return std::isfinite(k.number) ? out << k.number : out;
  }
};

/// `tx,ty,tz,qx,qy,qz,qw`
void write_pose(std::ostream& out, const Eigen::Isometry3d& pose) {
  Eigen::Quaterniond q(pose.linear());
  q.normalize();
  if (q.w() < 0) q.coeffs() *= -1;
  const Eigen::Vector3d t = pose.translation();
  out << t.x() << ',' << t.y() << ',' << t.z() << ',' << q.x() << ',' << q.y() << ',' << q.z() << ','
      << q.w();
}

/// Standard deviations in plan, in height and of yaw, at the center.
struct pose_sigmas {
  double in_plane, height, yaw_deg;

  explicit pose_sigmas(const survey::scan& scan) {
    const transform_uncertainty& u = *scan.uncertainty;
    const Eigen::Matrix3d at_center = u.at(u.center);
    const double upwards = u.up.dot(at_center * u.up);
    in_plane = std::sqrt(std::max(0.0, at_center.trace() - upwards) / 2);
    height = scan.is_height_known ? std::sqrt(upwards) : std::nan("");
    yaw_deg = std::sqrt(u.covariance(3, 3)) * 180 / std::numbers::pi;
  }
};

bool has_place(const survey_row& row, const survey& result) {
  return row.scan && result.scans[*row.scan].component >= 0;
}

void write_row(std::ostream& out, const survey_row& row, const survey& result) {
  out << field(row.name) << ',' << row.status << ',';
  if (!has_place(row, result)) {
    out << "-1" << std::string(12, ',') << "0"
        << ",,," << field(row.reason) << '\n';
    return;
  }
  const survey::scan& scan = result.scans[*row.scan];
  out << scan.component << ',';
  write_pose(out, scan.survey_from_scan);
  if (scan.uncertainty) {
    const pose_sigmas sigmas(scan);
    out << ',' << sigmas.in_plane << ',' << known{sigmas.height} << ',' << sigmas.yaw_deg;
  } else {
    out << ",,,";
  }
  out << ',' << scan.links << ',' << known{scan.check_median} << ',' << known{scan.check_worst} << ','
      << field(row.reason) << '\n';
}

nlohmann::ordered_json numbers_of(const Eigen::Isometry3d& transform) {
  nlohmann::ordered_json numbers = nlohmann::ordered_json::array();
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) numbers.push_back(transform.matrix()(r, c));
  return numbers;
}

}  // namespace

void write_poses(const fs::path& path, const std::vector<survey_row>& rows, const survey& result) {
  atomic_file file(path);
  file.stream() << "scan,status,component,tx,ty,tz,qx,qy,qz,qw,sigma_plan,sigma_height,sigma_yaw_deg,links,"
                   "check_median,check_worst,reason\n";
  for (const survey_row& row : rows) write_row(file.stream(), row, result);
  file.commit();
}

void write_links(const fs::path& path, const std::vector<std::string>& names, const survey& result) {
  atomic_file file(path);
  file.stream()
      << "source,target,tx,ty,tz,qx,qy,qz,qw,sigma_plan,sigma_yaw_deg,nfa,log10_nfa,inliers,rms,residual,"
         "closure,cycles,used,targets\n";
  for (const survey::link& l : result.links) {
    file.stream() << field(names[l.source]) << ',' << field(names[l.target]) << ',';
    write_pose(file.stream(), l.target_from_source);
    file.stream() << ',' << l.sigma_plan << ',' << l.sigma_yaw * 180 / std::numbers::pi << ','
                  << known{std::pow(10, l.log10_nfa)} << ',' << known{l.log10_nfa} << ',' << l.correspondences
                  << ',' << l.rms << ',';
    if (l.used) file.stream() << l.residual;
    file.stream() << ',' << known{l.closure} << ',' << l.supporting_cycles << ',' << (l.used ? 1 : 0) << ','
                  << l.targets << '\n';
  }
  file.commit();
}

void write_trees(const fs::path& path, const std::vector<std::string>& names, const survey& result) {
  atomic_file file(path);
  file.stream() << "id,x,y,z,radius,sigma_plan,sigma_height,component,scans\n";
  for (std::size_t i = 0; i < result.trees.size(); ++i) {
    const survey::tree& t = result.trees[i];
    std::string scans;
    for (const survey::observation& o : t.seen) scans += (scans.empty() ? "" : " ") + names[o.scan];
    file.stream() << i << ',' << t.position.x() << ',' << t.position.y() << ',' << t.position.z() << ',';
    if (t.radius > 0) file.stream() << t.radius;
    file.stream() << ',' << t.sigma << ',' << known{t.height_sigma} << ',' << t.component << ','
                  << field(scans) << '\n';
  }
  file.commit();
}

void write_poses_as_matrices(const fs::path& folder, const std::vector<survey_row>& rows,
                             const survey& result) {
  for (const survey_row& row : rows)
    write_or_remove_transform(
        folder / ("T_" + row.name + ".txt"),
        has_place(row, result) ? std::optional(result.scans[*row.scan].survey_from_scan) : std::nullopt);
}

void write_survey(const fs::path& folder, const std::vector<survey_row>& rows,
                  const std::vector<std::string>& names, const survey& result,
                  const nlohmann::ordered_json& report) {
  write_poses_as_matrices(folder, rows, result);
  write_links(folder / "links.csv", names, result);
  write_trees(folder / "trees.csv", names, result);
  write_json(folder / "survey.json", report);
  write_poses(folder / "poses.csv", rows, result);
}

std::string recorded_reference(const fs::path& report) {
  std::ifstream in(report);
  const auto earlier = nlohmann::ordered_json::parse(in, nullptr, false);
  return earlier.is_object() && earlier.contains("reference") && earlier["reference"].is_string()
             ? earlier["reference"].get<std::string>()
             : "";
}

std::string reference_of(const survey& result, const std::vector<std::string>& names) {
  for (std::size_t i = 0; i < names.size(); ++i)
    if (const survey::scan& s = result.scans[i];
        s.component == 0 && s.uncertainty && s.uncertainty->covariance(3, 3) == 0)
      return names[i];
  return "";
}

std::string in_words(const std::string& status) {
  std::string words = status;
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

void fill_statuses(std::vector<survey_row>& rows, const survey& result) {
  for (survey_row& row : rows) {
    if (!row.scan) continue;
    row.status = to_string(result.scans[*row.scan].status);
    row.reason = result.scans[*row.scan].reason;
  }
}

bool report_unplaced(const std::vector<survey_row>& rows, const survey& result) {
  bool all_placed = result.components == 1;
  for (const survey_row& row : rows) {
    if (row.status == "placed") continue;
    all_placed = false;
    std::cerr << row.name << ": " << in_words(row.status) << (row.reason.empty() ? "" : ", ") << row.reason
              << '\n';
  }
  return all_placed;
}

std::string summary(const std::vector<survey_row>& rows, const survey& result) {
  const auto placed =
      std::count_if(rows.begin(), rows.end(), [](const survey_row& row) { return row.status == "placed"; });
  return std::to_string(placed) + " of " + std::to_string(rows.size()) + " scans placed, " +
         std::to_string(result.components) + (result.components == 1 ? " component, " : " components, ") +
         std::to_string(result.trees.size()) + " trees";
}

nlohmann::ordered_json describe(const std::vector<survey_row>& rows, const survey& result) {
  auto scans = nlohmann::ordered_json::array();
  for (const survey_row& row : rows) {
    nlohmann::ordered_json scan = {{"scan", row.name}, {"status", row.status}, {"reason", row.reason}};
    if (row.scan) {
      const survey::scan& s = result.scans[*row.scan];
      scan["component"] = s.component;
      scan["survey_from_scan"] = numbers_of(s.survey_from_scan);
      scan["height_known"] = s.is_height_known;
      scan["links"] = s.links;
      if (std::isfinite(s.fixed_distance)) scan["fixed_distance"] = s.fixed_distance;
      if (std::isfinite(s.prior_deviations)) scan["prior_deviations"] = s.prior_deviations;
      for (const Eigen::Isometry3d& other : s.alternatives) scan["alternatives"].push_back(numbers_of(other));
    }
    scans.push_back(std::move(scan));
  }
  const auto used =
      std::count_if(result.links.begin(), result.links.end(), [](const auto& l) { return l.used; });
  auto frames = nlohmann::ordered_json::array();
  for (const survey::frame& f : result.frames)
    frames.push_back({{"source", to_string(f.source)},
                      {"sigma_yaw_deg", std::isfinite(f.yaw_sigma)
                                            ? nlohmann::ordered_json(f.yaw_sigma * 180 / std::numbers::pi)
                                            : nlohmann::ordered_json()}});
  return {{"components", result.components}, {"frames", std::move(frames)},
          {"links", result.links.size()},    {"links_used", used},
          {"candidates", result.candidates}, {"trees", result.trees.size()},
          {"scans", std::move(scans)}};
}

}  // namespace globalmatch::support

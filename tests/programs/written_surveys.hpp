// Surveys in files: stem maps of one stand, and what a survey wrote of them.
#pragma once

#include <Eigen/Geometry>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "globalmatch/detail/core/random.hpp"
#include "support/stem_files.hpp"
#include "support/temporary_directory.hpp"

namespace globalmatch::support {

using detail::random_source;

/// A stand, and what is seen of it within 25 m of a place, in a frame that is turned and begins there.
inline std::vector<stem_record> stand(std::uint64_t seed) {
  random_source random(seed);
  std::vector<stem_record> stems;
  for (int i = 0; i < 400; ++i)
    stems.push_back(
        {70 * random.uniform(), 70 * random.uniform(), random.normal(), 0.1 + 0.1 * random.uniform()});
  return stems;
}

inline Eigen::Isometry3d pose_at(double x, double y, double yaw) {
  return Eigen::Translation3d(x, y, 0.1 * x) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
}

inline void write_seen(const std::filesystem::path& file, const std::vector<stem_record>& stems,
                       const Eigen::Isometry3d& stand_from_scan, std::uint64_t seed) {
  random_source random(seed);
  std::vector<stem_record> seen;
  for (const stem_record& s : stems) {
    const Eigen::Vector3d p = stand_from_scan.inverse() * Eigen::Vector3d(s.x, s.y, s.z);
    if (p.head<2>().norm() > 25 || random.uniform() < 0.2) continue;
    seen.push_back({p.x() + 0.01 * random.normal(), p.y() + 0.01 * random.normal(), p.z(), s.radius});
  }
  write_stems(file, seen);
}

/// Three maps of one stand, in three frames.
inline std::vector<Eigen::Isometry3d> write_three(const temporary_directory& directory) {
  const auto stems = stand(1);
  const std::vector<Eigen::Isometry3d> poses = {pose_at(25, 25, 0.3), pose_at(40, 30, 2),
                                                pose_at(35, 45, -1)};
  for (std::size_t i = 0; i < poses.size(); ++i)
    write_seen(directory / ("s" + std::to_string(i + 1) + ".csv"), stems, poses[i], i + 10);
  return poses;
}

/// Lines of a file.
inline std::vector<std::string> lines_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

inline std::string row_of(const std::filesystem::path& poses, const std::string& name) {
  for (const std::string& line : lines_of(poses))
    if (line.rfind(name + ",", 0) == 0) return line;
  return "";
}

/// Maps of one stand around `count` places of a grid of 15 m, s1.csv and so on.
inline void write_stand(const temporary_directory& directory, std::size_t count) {
  const auto stems = stand(1);
  for (std::size_t i = 0; i < count; ++i)
    write_seen(directory / ("s" + std::to_string(i + 1) + ".csv"), stems,
               pose_at(20 + 15 * double(i % 3), 20 + 15 * double(i / 3), double(i)), i + 10);
}

/// The bytes of all files that a survey wrote besides its maps and matches, by their names.
inline std::map<std::string, std::string> results_in(const std::filesystem::path& folder) {
  std::map<std::string, std::string> results;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.is_regular_file()) results[entry.path().filename().string()] = bytes_of(entry.path());
  return results;
}

}  // namespace globalmatch::support

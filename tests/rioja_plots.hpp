// The best fits of eight plots that were scanned and surveyed by hand, as the shared data have them.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

namespace globalmatch::scenes {

struct reference_transform {
  double yaw;             // [rad]
  Eigen::Vector2d shift;  // [m]
};

/// Best fits by plot ("01" to "08") from a table whose columns are named in its first line.
inline std::map<std::string, reference_transform> read_rioja_transforms(const std::filesystem::path& path) {
  std::ifstream file(path);
  const auto fields = [&] {
    std::vector<std::string> result;
    std::string line, field;
    std::getline(file, line);
    for (std::istringstream stream(line); std::getline(stream, field, ',');) result.push_back(field);
    return result;
  };
  const auto names = fields();
  const auto column = [&](const std::string& name) {
    return std::size_t(std::find(names.begin(), names.end(), name) - names.begin());
  };
  std::map<std::string, reference_transform> transforms;
  for (auto row = fields(); row.size() == names.size(); row = fields())
    transforms[row[column("src")].substr(6, 2)] = {
        std::stod(row[column("refined_yaw_deg")]) * std::numbers::pi / 180,
        {std::stod(row[column("refined_tx")]), std::stod(row[column("refined_ty")])}};
  return transforms;
}

}  // namespace globalmatch::scenes

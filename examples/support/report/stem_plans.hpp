// The stem maps of a registration as pictures: as it came out, and under its other hypotheses.
#pragma once

#include <globalmatch/registration_options.hpp>

#include <Eigen/Geometry>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "support/plan_picture.hpp"

namespace globalmatch::support {

/// The smallest rotation that makes `up` z.
Eigen::Isometry3d levelling(const Eigen::Vector3d& up);

/// A transform of two scans that can be looked at, and the stems that it pairs.
struct shown_transform {
  std::string label;                                       ///< "Result", "Alternative 1"
  std::optional<Eigen::Isometry3d> target_from_source;     ///< empty: there is none to show
  std::vector<std::pair<stem_index, stem_index>> matches;  ///< (source, target)
};

/// The result, where there is one, and the next best hypotheses, some at most; never empty.
std::vector<shown_transform> transforms_to_show(const registration& result);

/// A stem map as a picture takes it: upright.
struct upright_map {
  Eigen::Isometry3d level;  ///< upright from scan
  std::vector<Eigen::Vector3d> positions;
  std::vector<double> radii, variances;  ///< [m], [m^2] of the positions in plan, along each axis

  explicit upright_map(const stem_map& map);
};

/// Both maps before and after a transform. Refers to all of them.
plan_picture picture_of(const upright_map& source, const upright_map& target, const shown_transform& shown);

/// Draws the result as a file. Throws `file_error`.
void write_stem_plan(const std::filesystem::path& path, const stem_map& source, const stem_map& target,
                     const registration& result, std::string_view title);

}  // namespace globalmatch::support

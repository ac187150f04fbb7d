// A drawing of two stem maps before and after matching, seen from above (SVG).
#pragma once

#include <Eigen/Geometry>

#include "globalmatch/points.hpp"

#include <filesystem>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <utility>

namespace globalmatch::support {

/// What `write_plan_picture` draws; refers to the caller's data.
struct plan_picture {
  /// One stem map: positions in its own frame, seen along z.
  struct map {
    std::span<const Eigen::Vector3d> positions;  ///< [m]
    std::span<const double> radii = {};          ///< [m] one for each stem (NaN: not known), or none
  };

  map source;
  map target;
  /// Stems that were matched: (index in source, index in target).
  std::span<const std::pair<stem_index, stem_index>> matches = {};
  std::optional<Eigen::Isometry3d> target_from_source =
      {};  ///< empty: the right panel says that there is none
  std::string title = "Two stem maps, seen from above";
  std::string caption = {};  ///< the outcome in words, below the legend
};

/// Draws two panels at one scale. Left: each map in its own frame, its middle moved to the panel's. Right:
/// the source in the frame of the target; matched stems are filled, source in target, joined by a line and in
/// a yellow halo; all others are hollow. Throws `std::invalid_argument` when positions are not finite, radii
/// are neither none nor one for each stem, or a match names no stem.
void draw_plan_picture(std::ostream& out, const plan_picture& picture);

/// The same as a file. Throws `file_error` when it cannot be written.
void write_plan_picture(const std::filesystem::path& path, const plan_picture& picture);

}  // namespace globalmatch::support

// Transforms as other programs read them.
#pragma once

#include <globalmatch/points.hpp>

#include <Eigen/Geometry>

#include <filesystem>
#include <iterator>
#include <optional>
#include <ostream>
#include <span>
#include <string>

namespace globalmatch::support {

/// A transform about a place near the points: target = R (p - center) + center + shift. Where coordinates are
/// large, programs that compute in single precision lose nothing by it.
struct centred_transform {
  Eigen::Matrix3d rotation;  ///< times the scale, if there is one
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
};

/// The transform about `near_points` rounded to 100 m, or about zero where that is nearer than 1 km on each
/// axis.
centred_transform centre(const Eigen::Isometry3d& target_from_source, const Eigen::Vector3d& near_points);

/// The poses in the headers of both files (survey_from_file). CloudCompare and PDAL apply them when they load
/// a file, and RiSCAN PRO has them as SOP matrices; this project does not.
struct header_poses {
  Eigen::Isometry3d source = Eigen::Isometry3d::Identity(), target = Eigen::Isometry3d::Identity();
};

/// Throws `file_error` for the first name that does not end as `write_transform_form` says, is no form for
/// the file `source`, is one of both files, or cannot be written. To be asked before long work.
void require_forms(std::span<const std::filesystem::path> paths, const std::filesystem::path& source,
                   const std::filesystem::path& target);

/// Writes a transform of the file `source` in the form that the name asks for, so that it fits to the target
/// where that was loaded with its pose:
/// - .mat.txt, .cc.txt: CloudCompare, four lines of four numbers, for the source as loaded with its pose;
///   centred where coordinates are large
/// - .json: a pipeline for PDAL, for the source as loaded with its pose (`pdal_pipeline`)
/// - .dat: RiSCAN PRO, the pose to give to the source, never centred
/// - .e57, .ptx: a copy of `source`, of that format, which has this pose
/// `near_points` is in the frame of the file. Returns the line that applies it. Throws `file_error` when it
/// cannot be written, or PDAL cannot read the source.
std::string write_transform_form(const std::filesystem::path& path,
                                 const Eigen::Isometry3d& target_from_source,
                                 const Eigen::Vector3d& near_points, const std::filesystem::path& source,
                                 const header_poses& poses = {});

/// Writes all of these forms, and a line for each to `out`; and if one is centred, of poses, or rounded where
/// it is applied, that too. Removes files of these names where there is no transform.
void write_or_remove_forms(std::span<const std::filesystem::path> paths,
                           const std::optional<Eigen::Isometry3d>& target_from_source,
                           const Eigen::Vector3d& near_points, const std::filesystem::path& source,
                           std::ostream& out, const header_poses& poses = {});

/// The position of a stem, as a place near the points; zero where there is no stem.
template <class Stems>
Eigen::Vector3d first_stem(const Stems& stems) {
  if (std::empty(stems)) return Eigen::Vector3d::Zero();
  const auto p = globalmatch::xyz(*std::begin(stems));
  return {p[0], p[1], p[2]};
}

}  // namespace globalmatch::support

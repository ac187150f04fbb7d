// Pipelines for PDAL that transform a file of points.
#pragma once

#include <Eigen/Core>

#include <filesystem>
#include <string>

namespace globalmatch::support {

/// Throws `file_error` for the pipeline `path` where PDAL cannot read `source` as this program does: one scan
/// of several, standard input, a folder, and text whose first line does not name x, y and z.
void require_pdal_source(const std::filesystem::path& path, const std::filesystem::path& source);

/// A pipeline that reads `source`, transforms it, and writes SOURCE_registered beside it: in the format of
/// the source where PDAL writes that in double precision, otherwise as LAZ.
std::string pdal_pipeline(const std::filesystem::path& source, const Eigen::Matrix4d& transform);

}  // namespace globalmatch::support

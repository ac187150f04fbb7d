#include "support/transform_forms.hpp"

#include <nlohmann/json.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <locale>
#include <sstream>
#include <string_view>
#include <system_error>

#include "support/atomic_file.hpp"
#include "support/file_error.hpp"
#include "support/numbered_scans.hpp"
#include "support/posed_copies.hpp"
#include "support/scan_files.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

enum class form { cloudcompare, riscan, pdal, posed_copy };

std::optional<form> form_of(const std::filesystem::path& path) {
  const std::string name = lower_case(path.filename().string());
  if (name.ends_with(".mat.txt") || name.ends_with(".cc.txt")) return form::cloudcompare;
  if (name.ends_with(".dat")) return form::riscan;
  if (name.ends_with(".json")) return form::pdal;
  if (is_posed_copy(path)) return form::posed_copy;
  return std::nullopt;
}

void require_form(const std::filesystem::path& path) {
  if (!form_of(path))
    throw file_error(
        path, "has no ending that names the form of a transform",
        "Name it .mat.txt or .cc.txt (CloudCompare), .dat (RiSCAN PRO), .json (PDAL), or .e57 or "
        ".ptx for a copy of the scan with its pose");
}

std::string to_text(const Eigen::Matrix4d& m, std::string_view line_end) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(std::numeric_limits<double>::max_digits10);
  for (Eigen::Index row = 0; row < 4; ++row)
    text << m(row, 0) << ' ' << m(row, 1) << ' ' << m(row, 2) << ' ' << m(row, 3) << line_end;
  return text.str();
}

std::string to_text(const Eigen::Vector3d& v) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(std::numeric_limits<double>::max_digits10);
  text << v.x() << ' ' << v.y() << ' ' << v.z();
  return text.str();
}

std::string quoted_path(const std::filesystem::path& path) {
  return '"' + path.string() + '"';
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  atomic_file file(path);
  file.stream() << text;
  file.commit();
}

// CloudCompare transforms what is left of the coordinates once the global shift was added to them.
std::string write_for_cloudcompare(const std::filesystem::path& path, const centred_transform& centred,
                                   const std::filesystem::path& source) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = centred.rotation;
  matrix.topRightCorner<3, 1>() = centred.shift;
  write_text(path, to_text(matrix, "\n"));
  const bool is_shifted = !centred.center.isZero(0);
  return "CloudCompare -SILENT -O " +
         (is_shifted ? "-GLOBAL_SHIFT " + to_text(Eigen::Vector3d(-centred.center)) + ' ' : std::string()) +
         quoted_path(source) + " -APPLY_TRANS " + quoted_path(path) + " -SAVE_CLOUDS";
}

// The file that PDAL writes: in the format of the source if it writes that, otherwise LAZ.
std::filesystem::path registered_path(const std::filesystem::path& source) {
  constexpr std::array<std::string_view, 8> written = {".ply", ".las", ".laz", ".pcd",
                                                       ".e57", ".csv", ".txt", ".xyz"};
  const std::string extension = source.extension().string();
  const bool is_written = std::find(written.begin(), written.end(), lower_case(extension)) != written.end();
  std::filesystem::path registered = source;
  registered.replace_filename(source.stem().string() + "_registered" + (is_written ? extension : ".laz"));
  return registered;
}

std::string write_for_pdal(const std::filesystem::path& path, const Eigen::Matrix4d& matrix,
                           const std::filesystem::path& source) {
  if (parse_scan_name(source).number)
    throw file_error(path, "cannot name scan " + source.string() + " to PDAL, which reads whole files",
                     "Export that scan as a file of its own");
  const std::filesystem::path registered = registered_path(source);
  nlohmann::ordered_json writer = {{"filename", registered.string()}};
  const std::string extension = lower_case(registered.extension().string());
  if (extension == ".las" || extension == ".laz")
    writer.update({{"type", "writers.las"},
                   {"forward", "all"},
                   {"extra_dims", "all"},
                   {"offset_x", "auto"},
                   {"offset_y", "auto"},
                   {"offset_z", "auto"}});
  std::string numbers = to_text(matrix, " ");
  numbers.pop_back();
  const nlohmann::ordered_json pipeline = {
      source.string(), {{"type", "filters.transformation"}, {"matrix", numbers}}, writer};
  write_text(path, pipeline.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + '\n');
  return "pdal pipeline " + quoted_path(path);
}

void remove_earlier(const std::filesystem::path& path) {
  std::error_code absent, error;
  if (std::filesystem::is_regular_file(path, absent)) std::filesystem::remove(path, error);
  if (error)
    throw file_error(path, "an earlier result cannot be removed",
                     "Remove it by hand: it is not of these scans");
}

}  // namespace

centred_transform centre(const Eigen::Isometry3d& target_from_source, const Eigen::Vector3d& near_points) {
  constexpr double near_zero = 1000, rounding = 100;  // [m]; floats are 0.06 mm apart at 1 km
  centred_transform centred{target_from_source.linear()};
  if (near_points.allFinite() && near_points.cwiseAbs().maxCoeff() >= near_zero)
    centred.center = (near_points / rounding).array().round().matrix() * rounding;
  centred.shift = target_from_source * centred.center - centred.center;
  return centred;
}

void require_forms(std::span<const std::filesystem::path> paths, const std::filesystem::path& source,
                   const std::filesystem::path& target) {
  for (const std::filesystem::path& path : paths) {
    require_form(path);
    require_writable({path});
    for (const std::filesystem::path& scan : {source, target}) {
      std::error_code absent;
      if (std::filesystem::equivalent(path, parse_scan_name(scan).path, absent))
        throw file_error(path, "is one of the files to be read", "Name another file");
    }
    if (form_of(path) == form::posed_copy) require_posed_copy(path, source);
  }
}

std::string write_transform_form(const std::filesystem::path& path,
                                 const Eigen::Isometry3d& target_from_source,
                                 const Eigen::Vector3d& near_points, const std::filesystem::path& source,
                                 const Eigen::Isometry3d& survey_from_target) {
  require_form(path);
  if (form_of(path) == form::posed_copy) {
    write_posed_copy(path, source, survey_from_target * target_from_source);
    return "CloudCompare " + quoted_path(path);
  }
  if (form_of(path) == form::cloudcompare)
    return write_for_cloudcompare(path, centre(target_from_source, near_points), source);
  if (form_of(path) == form::pdal) return write_for_pdal(path, target_from_source.matrix(), source);
  write_text(path, to_text(target_from_source.matrix(), "\n"));
  return "RiSCAN PRO: load " + quoted_path(path) + " as the SOP matrix of the scan position of " +
         quoted_path(source);
}

void write_or_remove_forms(std::span<const std::filesystem::path> paths,
                           const std::optional<Eigen::Isometry3d>& target_from_source,
                           const Eigen::Vector3d& near_points, const std::filesystem::path& source,
                           std::ostream& out, const Eigen::Isometry3d& survey_from_target) {
  bool is_shifted = false;
  for (const std::filesystem::path& path : paths) {
    if (!target_from_source) {
      remove_earlier(path);
      continue;
    }
    out << write_transform_form(path, *target_from_source, near_points, source, survey_from_target) << '\n';
    is_shifted = is_shifted || form_of(path) == form::cloudcompare;
  }
  if (!is_shifted) return;
  const centred_transform centred = centre(*target_from_source, near_points);
  if (!centred.center.isZero(0))
    out << "for CloudCompare the transform is target = R (p - c) + c + t, c = " << to_text(centred.center)
        << ", t = " << to_text(centred.shift) << '\n';
}

}  // namespace globalmatch::support

#include "support/transform_forms.hpp"

#include <cmath>
#include <iomanip>
#include <limits>
#include <locale>
#include <sstream>
#include <string_view>
#include <system_error>

#include "support/atomic_file.hpp"
#include "support/file_error.hpp"
#include "support/numbered_scans.hpp"
#include "support/pdal_pipelines.hpp"
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

bool is_one_file(const std::filesystem::path& source) {
  std::error_code ignored;
  return source != "-" && !parse_scan_name(source).number && !std::filesystem::is_directory(source, ignored);
}

// CloudCompare transforms what is left of the coordinates once the global shift was added to them.
std::string write_for_cloudcompare(const std::filesystem::path& path, const centred_transform& centred,
                                   const std::filesystem::path& source) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = centred.rotation;
  matrix.topRightCorner<3, 1>() = centred.shift;
  write_text(path, to_text(matrix, "\n"));
  const bool is_shifted = !centred.center.isZero(0);
  const std::string shift = to_text(Eigen::Vector3d(-centred.center));
  if (!is_one_file(source))
    return "CloudCompare: open " + quoted_path(source) + (is_shifted ? ", with the shift " + shift : "") +
           ", select it alone, and choose Edit > Apply transformation with " + quoted_path(path);
  return "CloudCompare -SILENT -O " + (is_shifted ? "-GLOBAL_SHIFT " + shift + ' ' : std::string()) +
         quoted_path(source) + " -APPLY_TRANS " + quoted_path(path) + " -SAVE_CLOUDS";
}

// The poses that are not applied here, those that others apply, and where both scans lie in the end.
struct posed_transform {
  Eigen::Isometry3d survey_from_source, survey_from_loaded;
  Eigen::Vector3d near_loaded_points;
};

posed_transform apply_poses(const Eigen::Isometry3d& target_from_source, const Eigen::Vector3d& near_points,
                            const header_poses& poses) {
  const Eigen::Isometry3d survey_from_source = poses.target * target_from_source;
  return {survey_from_source, survey_from_source * poses.source.inverse(), poses.source * near_points};
}

// [m] between neighbouring numbers of single precision.
double step_of_float(double number) {
  const auto f = static_cast<float>(std::abs(number));
  return double(std::nextafter(f, std::numeric_limits<float>::infinity())) - double(f);
}

void print_notes_on_cloudcompare(const centred_transform& centred, std::ostream& out) {
  if (!centred.center.isZero(0))
    out << "for CloudCompare the transform is target = R (p - c) + c + t, c = " << to_text(centred.center)
        << ", t = " << to_text(centred.shift) << '\n';
  constexpr double max_step = 0.001;  // [m]
  const double step = step_of_float(centred.shift.cwiseAbs().maxCoeff());
  if (step <= max_step) return;
  std::ostringstream rounded;  // keeps the precision of `out`
  rounded << std::setprecision(2) << step;
  out << "warning: CloudCompare computes in single precision: so far from the source it rounds coordinates "
         "to "
      << rounded.str() << " m; register_scans --write, or PDAL, keeps them\n";
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
    if (form_of(path) == form::pdal) require_pdal_source(path, source);
  }
}

std::string write_transform_form(const std::filesystem::path& path,
                                 const Eigen::Isometry3d& target_from_source,
                                 const Eigen::Vector3d& near_points, const std::filesystem::path& source,
                                 const header_poses& poses) {
  require_form(path);
  const posed_transform posed = apply_poses(target_from_source, near_points, poses);
  switch (*form_of(path)) {
    case form::posed_copy:
      write_posed_copy(path, source, posed.survey_from_source);
      return "CloudCompare " + quoted_path(path) +
             (scans_in(parse_scan_name(source).path).size() > 1
                  ? ": only the scan of " + quoted_path(source) + " has another pose, the others keep theirs"
                  : "");
    case form::cloudcompare:
      return write_for_cloudcompare(path, centre(posed.survey_from_loaded, posed.near_loaded_points), source);
    case form::pdal:
      require_pdal_source(path, source);
      write_text(path, pdal_pipeline(source, posed.survey_from_loaded.matrix()));
      return "pdal pipeline " + quoted_path(path);
    default:
      write_text(path, to_text(posed.survey_from_source.matrix(), "\n"));
      return "RiSCAN PRO: load " + quoted_path(path) + " as the SOP matrix of the scan position of " +
             quoted_path(source);
  }
}

void write_or_remove_forms(std::span<const std::filesystem::path> paths,
                           const std::optional<Eigen::Isometry3d>& target_from_source,
                           const Eigen::Vector3d& near_points, const std::filesystem::path& source,
                           std::ostream& out, const header_poses& poses) {
  bool for_cloudcompare = false, for_loaded = false;
  for (const std::filesystem::path& path : paths) {
    if (!target_from_source) {
      remove_earlier(path);
      continue;
    }
    out << write_transform_form(path, *target_from_source, near_points, source, poses) << '\n';
    for_cloudcompare = for_cloudcompare || form_of(path) == form::cloudcompare;
    for_loaded = for_loaded || form_of(path) == form::pdal;
  }
  if (!for_cloudcompare && !for_loaded) return;
  const auto is_posed = [](const Eigen::Isometry3d& p) { return p.matrix() != Eigen::Matrix4d::Identity(); };
  if (is_posed(poses.source) || is_posed(poses.target))
    out << "CloudCompare and PDAL apply the poses in the headers of scans when they load them: what is "
           "written for them is between scans so loaded, and differs from --out\n";
  if (!for_cloudcompare) return;
  const posed_transform posed = apply_poses(*target_from_source, near_points, poses);
  print_notes_on_cloudcompare(centre(posed.survey_from_loaded, posed.near_loaded_points), out);
}

}  // namespace globalmatch::support

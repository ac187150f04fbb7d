// The results of a survey as files: poses, links, trees.
#pragma once

#include <globalmatch/survey_options.hpp>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace globalmatch::support {

/// What became of an input: a scan of the survey, or not even that.
struct survey_row {
  std::string name;
  std::string status, reason = {};
  std::optional<std::size_t> scan = {};  ///< in the survey
};

/// `scan,status,component,tx,ty,tz,qx,qy,qz,qw,sigma_plan,sigma_height,sigma_yaw_deg,links,check_median,
/// check_worst,reason`: survey_from_scan, `p_survey = R(q) p + t`, metres, `qw >= 0`. Standard deviations are
/// along each axis, at the centroid of the scan's stems, against the reference of its component. What is not
/// known is empty. Throws `file_error`.
void write_poses(const std::filesystem::path& path, const std::vector<survey_row>& rows,
                 const survey& result);

/// `source,target,tx..qw,sigma_plan,sigma_yaw_deg,nfa,log10_nfa,inliers,rms,residual,closure,cycles,used,
/// targets`: target_from_source of the pair alone, its standard deviations at the centroid of the paired
/// stems, or of the targets that link them.
void write_links(const std::filesystem::path& path, const std::vector<std::string>& names,
                 const survey& result);

/// `id,x,y,z,radius,sigma_plan,sigma_height,component,scans`, the names of the scans separated by blanks.
void write_trees(const std::filesystem::path& path, const std::vector<std::string>& names,
                 const survey& result);

/// `T_NAME.txt` of each scan that has a place; those of others, which an earlier run left, are removed.
void write_poses_as_matrices(const std::filesystem::path& folder, const std::vector<survey_row>& rows,
                             const survey& result);

/// All files of a survey. That of poses is the last one: it stands for all.
void write_survey(const std::filesystem::path& folder, const std::vector<survey_row>& rows,
                  const std::vector<std::string>& names, const survey& result,
                  const nlohmann::ordered_json& report);

/// The reference that an earlier run recorded in its `survey.json`, so that scans that are added do not move
/// the frame; empty where there is none.
std::string recorded_reference(const std::filesystem::path& report);

/// The scan that the poses of the component of most scans refer to; empty where none was placed.
std::string reference_of(const survey& result, const std::vector<std::string>& names);

/// As people read it: "placed alone" for `placed_alone`.
std::string in_words(const std::string& status);

/// Status and reason of the inputs that are scans of the survey.
void fill_statuses(std::vector<survey_row>& rows, const survey& result);

/// Names the inputs that were not placed on standard error; whether all were, in one frame.
bool report_unplaced(const std::vector<survey_row>& rows, const survey& result);

/// One line for people.
std::string summary(const std::vector<survey_row>& rows, const survey& result);

/// The same results, with alternatives, counts, and the reference.
nlohmann::ordered_json describe(const std::vector<survey_row>& rows, const survey& result);

}  // namespace globalmatch::support

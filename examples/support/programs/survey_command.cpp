#include "support/programs/survey_command.hpp"

#include <stdexcept>
#include <system_error>

#include "support/atomic_file.hpp"
#include "support/programs/survey_inputs.hpp"
#include "support/report/report_file.hpp"
#include "support/scan_sets.hpp"
#include "support/scan_writer.hpp"
#include "support/wildcards.hpp"

namespace globalmatch::support {

void survey_command::add_to(CLI::App& app) {
  auto* scans_given =
      app.add_option("SCAN", scans, "scans, or folders of them; name#K: scan K of a file of several");
  auto* stem_maps_given =
      app.add_option("--stem-maps", stem_maps, "stem maps (CSV), or folders of them, in place of scans")
          ->excludes(scans_given)
          ->type_name("CSV");
  app.add_option("--out-dir", out_dir,
                 "folder for poses.csv, links.csv, trees.csv, T_<scan>.txt, maps/, matches/, refined/")
      ->required()
      ->type_name("DIR");
  app.add_option("--fix", fix, "a scan whose matrix survey_from_scan is known; may be given several times")
      ->type_name("NAME=T.txt")
      ->take_all()
      ->allow_extra_args(false);
  app.add_option("--priors", priors,
                 "measured positions and yaws of scans, with their standard deviations: "
                 "scan,x,y,z,yaw_deg,sigma_xy,sigma_z,sigma_yaw_deg")
      ->type_name("CSV");
  app.add_option("--control", control,
                 "trees whose positions in the survey's frame are known, as a census in map coordinates: "
                 "x,y, and z, radius or dbh where they are known")
      ->type_name("CSV");
  app.add_option("--level", levels,
                 "a scan whose vertical is known to this standard deviation; may be given several times")
      ->type_name("NAME,SIGMA_DEG")
      ->take_all()
      ->allow_extra_args(false);
  app.add_option("--targets", targets,
                 "reflectors that scans show, in their frames, equal names being one point: "
                 "scan,target,x,y,z,sigma")
      ->type_name("CSV");
  auto* one_stage =
      app.add_option(
             "--only", only,
             "one stage: map the scans, match their maps, refine pairs of scans, or solve: all the rest, "
             "also what is missing of the others")
          ->check(CLI::IsMember({"map", "match", "refine", "solve"}));
  app.add_option("--part", part,
                 "of --only map, match or refine: every N-th scan or pair, to share them out over machines")
      ->needs(one_stage)
      ->type_name("I/N");
  auto* write = app.add_option("--write", write_folder, "each placed scan in the survey's frame")
                    ->excludes(stem_maps_given)
                    ->type_name("FOLDER");
  app.add_option("--write-as", write_format, "their format, in place of that of each scan")
      ->check(CLI::IsMember({"ply", "las", "laz"}))
      ->needs(write);
  app.add_option("--posed", posed_folder, "copies of E57 and PTX files whose scans have their poses")
      ->excludes(stem_maps_given)
      ->type_name("FOLDER");
  auto* merge = app.add_option("--merge", merged, "all placed scans in one file: .ply, .las or .laz")
                    ->excludes(stem_maps_given)
                    ->type_name("FILE");
  app.add_option("--voxel", voxel, "edge of the voxels [m], of each of which the first point is merged")
      ->check(CLI::PositiveNumber)
      ->needs(merge)
      ->type_name("M")
      ->capture_default_str();
  app.add_option(
         "--report", picture,
         "which scans to trust, and why: a page (.html), or a drawing of scans, links and trees (.svg)")
      ->type_name("FILE");
  options.add_mapping_to(app);
  options.add_icp_to(app);
  options.add_execution_to(app);
}

void survey_command::require_consistent() const {
  if (scans.empty() && stem_maps.empty())
    throw std::invalid_argument("SCAN: name scans, a folder of them, or --stem-maps");
  for (const auto& name : scans)
    if (parse_scan_name(name).path == "-")
      throw std::invalid_argument("SCAN -: a survey reads its scans several times; save this one to a file");
  parse_part(part);
  if (only == "solve" && !part.empty())
    throw std::invalid_argument("--part " + part + ": to solve is one piece of work; leave it out");
  if (only == "refine" && scans.empty())
    throw std::invalid_argument("--only refine: stem maps alone have nothing to refine by; name scans");
  if (!merged.empty()) require_scan_format(merged);
  require_report_format(picture);
}

void survey_command::prepare_folder() const {
  make_folder(out_dir);
  for (const char* folder : {".", "hashes", "maps", "matches", "refined"}) remove_abandoned(out_dir / folder);
  for (const auto& folder : {write_folder, posed_folder})
    if (!folder.empty()) remove_abandoned(folder);
  for (const auto& file : {merged, picture, options.json})
    if (!file.empty()) remove_abandoned(std::filesystem::absolute(file).parent_path());
}

std::vector<std::filesystem::path> survey_command::inputs() const {
  if (!scans.empty()) return find_scans(scans, options.tiles);
  std::vector<std::filesystem::path> patterns;
  for (const auto& name : stem_maps) {
    std::error_code ignored;
    patterns.push_back(std::filesystem::is_directory(name, ignored) ? name / "*.csv" : name);
  }
  return expand_patterns(patterns);
}

}  // namespace globalmatch::support

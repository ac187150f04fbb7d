#include "support/programs/survey_scans.hpp"

#include <algorithm>
#include <deque>
#include <iostream>
#include <memory>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include "support/atomic_file.hpp"
#include "support/file_error.hpp"
#include "support/programs/scan_colours.hpp"
#include "support/scan_writer.hpp"
#include "support/scans_on_demand.hpp"
#include "support/voxel_thinning.hpp"

namespace globalmatch::support {

namespace fs = std::filesystem;

namespace {

/// A format that a scan is written in: that of the option, or of the scan, or PLY, which all programs read.
std::string extension_for(const scan_header& header, const std::string& asked) {
  if (!asked.empty()) return "." + asked;
  if (!header.las) return ".ply";
  return header.format.starts_with("LAS") ? ".las" : ".laz";
}

/// Throws `file_error` where a scan would be replaced by what is read from it.
void require_other_file(const fs::path& path, const survey_work& work) {
  std::error_code absent;
  for (const fs::path& file : work.files)
    if (fs::equivalent(path, file, absent))
      throw file_error(path, "is one of the scans", "Name another folder or file to write");
}

/// Says of files that are named by scans, and were not written now, that they are older.
void report_older_files(const fs::path& folder, const survey_work& work, const std::set<fs::path>& written) {
  std::error_code absent;
  for (const survey_row& row : work.rows)
    for (const char* extension : {".ply", ".las", ".laz"}) {
      const fs::path path = folder / (row.name + extension);
      const auto is_path = [&](const fs::path& file) { return fs::equivalent(path, file, absent); };
      if (written.contains(path) || !fs::exists(path, absent) ||
          std::any_of(work.files.begin(), work.files.end(), is_path))
        continue;
      std::cerr << path.string() << " is of an earlier run; this one did not write it\n";
    }
}

}  // namespace

void write_placed_scans(const survey_work& work, const survey_command& command, const survey& result) {
  if (command.write_folder.empty() && command.merged.empty()) return;
  scan_options reading = command.options.for_reading();
  reading.attributes = true;
  const auto opener = std::make_shared<scan_opener>(reading);
  std::deque<scan_file> scans;  // where they stay
  std::vector<placed_scan> placed;
  if (!command.write_folder.empty()) make_folder(command.write_folder);
  std::set<fs::path> written;
  for (std::size_t m = 0; m < work.kept.size(); ++m) {
    const survey::scan& scan = result.scans[m];
    if (scan.component != 0 || m == work.control) continue;
    scans.push_back(open_on_demand(work.kept[m].path, opener));
    placed.push_back({&scans.back(), scan.survey_from_scan, scan_colour_of(placed.size())});
    if (command.write_folder.empty()) continue;
    const fs::path path =
        command.write_folder / (work.names[m] + extension_for(scans.back().header(), command.write_format));
    require_other_file(path, work);
    write_scans(path, {&placed.back(), 1}, command.options.threads);
    written.insert(path);
  }
  if (!command.write_folder.empty()) report_older_files(command.write_folder, work, written);
  if (command.merged.empty() || placed.empty()) return;
  require_other_file(command.merged, work);
  const auto kept = first_in_voxels(placed, command.voxel, command.options.threads);
  for (std::size_t s = 0; s < placed.size(); ++s) {
    scans.push_back(with_points(*placed[s].scan, kept[s]));
    placed[s].scan = &scans.back();
  }
  write_scans(command.merged, placed, command.options.threads);
}

}  // namespace globalmatch::support

#include "support/programs/survey_posed_files.hpp"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>
#include <string>
#include <system_error>

#include "support/atomic_file.hpp"
#include "support/file_error.hpp"
#include "support/numbered_scans.hpp"
#include "support/posed_copies.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace fs = std::filesystem;

namespace {

/// The file of a scan, if it has poses and can be read.
std::optional<fs::path> posed_file_of(const fs::path& scan) {
  const fs::path file = parse_scan_name(scan).path;
  std::error_code absent;
  if (!fs::is_regular_file(file, absent)) return std::nullopt;
  try {
    return is_posed_file(file) ? std::optional(file) : std::nullopt;
  } catch (const file_error&) {
    return std::nullopt;
  }
}

}  // namespace

void require_posed_files(const std::vector<survey_input>& inputs, const survey_command& command) {
  if (command.posed_folder.empty()) return;
  make_folder(command.posed_folder);
  std::map<std::string, fs::path> by_name;  // in lower case, as some systems do not distinguish them
  for (const survey_input& input : inputs) {
    const auto file = posed_file_of(input.path);
    if (!file) continue;
    const fs::path copy = command.posed_folder / file->filename();
    const auto [other, is_new] = by_name.emplace(lower_case(copy.filename().string()), *file);
    if (!is_new && other->second != *file)
      throw file_error(copy, "would be the copy of both " + other->second.string() + " and " + file->string(),
                       "Rename one of them");
    require_rewritable(copy, *file);
    std::error_code absent;
    for (const survey_input& replaced : inputs)
      if (fs::equivalent(copy, parse_scan_name(replaced.path).path, absent))
        throw file_error(copy, "is one of the scans", "Name another folder with --posed");
  }
  if (by_name.empty())
    throw file_error(command.posed_folder, "would stay empty: no scan is of an E57 or PTX file",
                     "Use --write, or the matrices T_<scan>.txt");
}

void write_posed_files(const survey_work& work, const survey_command& command, const survey& result) {
  if (command.posed_folder.empty()) return;
  std::map<fs::path, std::vector<scan_pose>> poses;
  for (const fs::path& scan : work.files)
    if (const auto file = posed_file_of(scan)) poses[*file];
  for (std::size_t m = 0; m < work.kept.size(); ++m) {
    if (result.scans[m].component != 0 || m == work.control) continue;
    if (const auto file = posed_file_of(work.kept[m].path))
      poses[*file].push_back(
          {parse_scan_name(work.kept[m].path).number.value_or(1), result.scans[m].survey_from_scan});
  }
  for (const auto& [file, of_file] : poses) {
    const fs::path copy = command.posed_folder / file.filename();
    write_posed_copy(copy, file, of_file);
    for (const fs::path& scan : scans_in(file)) {
      const std::size_t number = parse_scan_name(scan).number.value_or(1);
      if (std::none_of(of_file.begin(), of_file.end(), [&](const auto& p) { return p.number == number; }))
        std::cerr << copy.string() << ": scan " << number
                  << " keeps the pose that it had: it has no place in the survey\n";
    }
  }
}

}  // namespace globalmatch::support

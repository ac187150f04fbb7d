#include "support/programs/survey_matching.hpp"

#include <globalmatch/survey.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "support/atomic_file.hpp"
#include "support/build_record.hpp"
#include "support/content_hash.hpp"
#include "support/programs/survey_maps.hpp"

namespace globalmatch::support {

namespace fs = std::filesystem;

namespace {

constexpr const char* extension = ".gmatch";

/// What matches depend on: the contents of all inputs in their order, and how these were mapped.
survey_matches::record record_of(const survey_work& work, const survey_command& command) {
  std::string maps = command.scans.empty() ? "positions" : describe_mapping(command.options);
  for (const survey_input& input : work.kept) maps += "\n" + input.hash;
  return {text_hash(maps), this_build().name(), instruction_set()};
}

/// The matches of a file; nothing where it is not there, damaged, or of other maps.
std::optional<survey_matches> read_kept(const fs::path& file, const survey_matches::record& record,
                                        bool mixes_builds) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return std::nullopt;
  survey_matches matches;
  try {
    matches = read_survey_matches(in);
  } catch (const std::runtime_error&) {  // damaged, or of another version
    return std::nullopt;
  }
  if (matches.provenance == record) return matches;
  if (!mixes_builds && matches.provenance.maps == record.maps)
    require_this_build(file, matches.provenance.version, matches.provenance.processor);
  return std::nullopt;
}

}  // namespace

void match_part(const survey_work& work, const survey_command& command, const survey_options& options,
                const execution& exec) {
  const survey_matches::part part = parse_part(command.part);
  const std::string name = "part_" + name_of(part);
  const fs::path folder = command.out_dir / "matches", path = folder / (name + extension);
  make_folder(folder);
  const survey_matches::record record = record_of(work, command);
  if (read_kept(path, record, false)) {
    std::cout << name << ": matched before\n";
    return;
  }
  survey_matches matches = match_survey(work.maps, part, options, exec);
  if (matches.cancelled) throw operation_cancelled();
  matches.provenance = record;
  atomic_file file(path);
  write_survey_matches(file.stream(), matches);
  file.commit();
  std::cout << name << ": " << matches.maps.size() << " maps matched\n";
}

std::vector<survey_matches> kept_matches(const survey_work& work, const survey_command& command) {
  std::vector<fs::path> files;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(command.out_dir / "matches", none))
    if (entry.path().extension() == extension) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  const survey_matches::record record = record_of(work, command);
  std::vector<survey_matches> kept;
  for (const fs::path& file : files)
    if (auto matches = read_kept(file, record, command.only.empty())) kept.push_back(std::move(*matches));
  return kept;
}

}  // namespace globalmatch::support

#include "support/programs/survey_work.hpp"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <system_error>
#include <utility>

#include "support/numbered_scans.hpp"
#include "support/programs/reports.hpp"
#include "support/programs/survey_maps.hpp"

namespace globalmatch::support {

using json = nlohmann::ordered_json;

namespace {

void add(survey_work& work, const survey_input& input, survey_map mapped) {
  work.files.push_back(parse_scan_name(input.path).path);
  if (input.same_as) {
    work.rows.push_back({input.name, "unplaced", "same as " + *input.same_as, {}});
  } else if (!mapped.error.empty()) {
    work.rows.push_back({input.name, "unreadable", mapped.error, {}});
  } else {
    std::cout << input.name << ": " << mapped.map.stems.size() << " stems"
              << (mapped.was_kept ? ", mapped before\n" : "\n");
    work.rows.push_back({input.name, "", "", work.maps.size()});
    work.kept.push_back(input);
    work.names.push_back(input.name);
    work.maps.push_back(std::move(mapped.map));
  }
}

}  // namespace

std::optional<std::size_t> survey_work::index_of(const std::string& name) const {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return std::size_t(found - names.begin());
}

json describe_inputs(const std::vector<survey_input>& inputs, const survey_work& work) {
  json read = json::array(), warnings = json::array();
  const auto add_input = [&](const survey_input& input) {
    std::error_code absent;
    const auto bytes = std::filesystem::file_size(parse_scan_name(input.path).path, absent);
    read.push_back({{"scan", input.name},
                    {"path", input.path.string()},
                    {"bytes", absent ? json(nullptr) : json(bytes)},
                    {"hash", input.hash.empty() ? json(nullptr) : json(input.hash)}});
  };
  for (const survey_input& input : inputs) add_input(input);
  if (work.control) add_input(work.kept[*work.control]);
  for (std::size_t m = 0; m < work.maps.size(); ++m)
    for (const warning& w : warnings_of(work.maps[m], {}, true))
      warnings.push_back({{"scan", work.names[m]}, {"code", w.code}, {"text", w.text}});
  return {{"inputs", std::move(read)}, {"warnings", std::move(warnings)}};
}

survey_work map_inputs(const std::vector<survey_input>& inputs, const survey_command& command,
                       const execution& exec) {
  survey_work work;
  if (command.scans.empty()) {
    for (const survey_input& input : inputs) add(work, input, read_positions(input));
  } else {
    const bool mixes_builds = command.only.empty() || command.only == "map";
    const survey_mapper mapper(command.out_dir / "maps", command.options, mixes_builds);
    for (const survey_input& input : inputs) add(work, input, mapper.map(input, exec));
  }
  return work;
}

}  // namespace globalmatch::support

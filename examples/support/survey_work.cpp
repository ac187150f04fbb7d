#include "support/survey_work.hpp"

#include <algorithm>
#include <iostream>
#include <utility>

#include "support/survey_maps.hpp"

namespace globalmatch::support {

namespace {

void add(survey_work& work, const survey_input& input, survey_map mapped) {
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

survey_work map_inputs(const std::vector<survey_input>& inputs, const survey_command& command,
                       const execution& exec) {
  survey_work work;
  if (command.scans.empty()) {
    for (const survey_input& input : inputs) add(work, input, read_positions(input));
  } else {
    const survey_mapper mapper(command.out_dir / "maps", command.options);
    for (const survey_input& input : inputs) add(work, input, mapper.map(input, exec));
  }
  return work;
}

}  // namespace globalmatch::support

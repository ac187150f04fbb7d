// The maps of a survey, and what becomes of all its inputs.
#pragma once

#include <globalmatch/execution.hpp>
#include <globalmatch/stem_map.hpp>

#include <nlohmann/json.hpp>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "support/programs/survey_command.hpp"
#include "support/programs/survey_files.hpp"
#include "support/programs/survey_inputs.hpp"

namespace globalmatch::support {

struct survey_work {
  std::vector<survey_row> rows;              ///< of all inputs
  std::vector<survey_input> kept;            ///< those with maps
  std::vector<std::string> names;            ///< of those
  std::vector<stem_map> maps;                ///< theirs, without samples
  std::vector<std::filesystem::path> files;  ///< all inputs
  std::optional<std::size_t> control = {};   ///< the map of ground control, which is no scan: the last one

  /// The map of that name.
  std::optional<std::size_t> index_of(const std::string& name) const;
};

/// `inputs[{scan,path,bytes,hash}]`, null where one cannot be read, and `warnings[{scan,code,text}]` of the
/// maps.
nlohmann::ordered_json describe_inputs(const std::vector<survey_input>& inputs, const survey_work& work);

/// Maps the inputs, or reads their maps, and says so. One that cannot be read has that status. Throws
/// `file_error` where a map cannot be written, and `operation_cancelled`.
survey_work map_inputs(const std::vector<survey_input>& inputs, const survey_command& command,
                       const execution& exec);

}  // namespace globalmatch::support

// The inputs of a survey: scans or stem maps with names that differ, in an order of their contents.
#pragma once

#include <globalmatch/survey_matches.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "support/content_hash.hpp"

namespace globalmatch::support {

struct survey_input {
  std::filesystem::path path;               ///< may be `file#K`
  std::string name;                         ///< that results are named by
  std::string hash;                         ///< of the content, `content_hash`; empty where it cannot be read
  std::string error = {};                   ///< why it cannot be read
  std::optional<std::string> same_as = {};  ///< the name of an input of the same content before it
};

/// The inputs, by name; one that is named twice counts once. A name is that of the file without extension,
/// with `#K` for scan K of several; files of one name are named by their path below the folder that they have
/// in common, with `__` between folders. Throws `file_error` where names agree even so.
std::vector<survey_input> named_inputs(const std::vector<std::filesystem::path>& paths);

/// Hashes the inputs and sorts them by hash, so that results do not depend on the order in which they were
/// named.
void hash_inputs(std::vector<survey_input>& inputs, const hash_notes& notes = {});

/// "I/N", I from 1 to N, or all where it is empty. Throws `std::invalid_argument` for what is no part.
survey_matches::part parse_part(const std::string& text);

/// "I_of_N", for names of files.
std::string name_of(const survey_matches::part& part);

/// Every N-th input, from the I-th on.
std::vector<survey_input> part_of(std::vector<survey_input> inputs, const survey_matches::part& part);

}  // namespace globalmatch::support

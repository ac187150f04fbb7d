// The inputs of a survey: scans or stem maps with names that differ, in an order of their contents.
#pragma once

#include <globalmatch/survey_matches.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace globalmatch::support {

struct survey_input {
  std::filesystem::path path;  ///< may be `file#K`
  std::string name;            ///< that results are named by
  std::string hash;            ///< of the content, 16 hexadecimal digits; empty where it cannot be read
  std::string error = {};      ///< why it cannot be read
  std::optional<std::string> same_as = {};  ///< the name of an input of the same content before it
};

/// Name and hash the inputs, and sort them by hash, so that results do not depend on the order in which they
/// were named; one that is named twice counts once. A name is that of the file without extension, with `#K`
/// for scan K of several; files of one name are named by their path below the folder that they have in
/// common, with `__` between folders. Throws `file_error` where names agree even so.
std::vector<survey_input> survey_inputs(const std::vector<std::filesystem::path>& paths);

/// "I/N", I from 1 to N, or all where it is empty. Throws `std::invalid_argument` for what is no part.
survey_matches::part parse_part(const std::string& text);

/// "I_of_N", for names of files.
std::string name_of(const survey_matches::part& part);

/// Every N-th input, from the I-th on.
std::vector<survey_input> part_of(std::vector<survey_input> inputs, const survey_matches::part& part);

/// Hash of all bytes of a file, 64 bits. Throws `file_error`.
std::uint64_t content_hash(const std::filesystem::path& file);

/// The same of a text, as 16 hexadecimal digits.
std::string text_hash(const std::string& text);

}  // namespace globalmatch::support

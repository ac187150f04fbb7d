// Internal to the readers: formats of makers of scanners and of programs, which only their own software
// reads.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace globalmatch::support {

/// What a file is, and how to make of it one that can be read; for `file_error`.
struct makers_format {
  std::string problem;  ///< as "is a RIEGL RXP file, which this program does not read"
  std::string remedy;   ///< names the export to choose
};

/// The format of a maker that a file is in; nothing if it is none of those known here. Where content does not
/// tell, the extension does, but not of files of text. `.bin` is the name of many formats, so content alone
/// tells that one is CloudCompare's.
std::optional<makers_format> recognise_makers_format(std::string_view start,
                                                     const std::filesystem::path& path);

/// The same of a folder, or of a file that is not opened, by extension alone.
std::optional<makers_format> recognise_makers_name(const std::filesystem::path& path);

}  // namespace globalmatch::support

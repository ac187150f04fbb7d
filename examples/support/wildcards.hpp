// Names of files with wildcards, which the shells of Windows leave to programs.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

namespace globalmatch::support {

/// Whether a name fits a pattern, in which `*` stands for any characters and `?` for one.
bool matches(std::string_view name, std::string_view pattern);

/// The names, in their order. In place of each that has `*` or `?` and is that of no file come the files and
/// folders that it matches, sorted; the pattern of `name#K` is `name`. Hidden ones are matched only by a
/// pattern that begins with a dot. Throws `file_error` for a pattern that matches nothing.
std::vector<std::filesystem::path> expand_patterns(const std::vector<std::filesystem::path>& names);

}  // namespace globalmatch::support

#include "support/wildcards.hpp"

#include <algorithm>
#include <cstddef>
#include <string>
#include <system_error>

#include "support/file_error.hpp"
#include "support/numbered_scans.hpp"

namespace globalmatch::support {

namespace fs = std::filesystem;

namespace {

bool has_wildcards(const fs::path& path) {
  return path.string().find_first_of("*?") != std::string::npos;
}

// Adds what is in a folder and fits the parts [part, end) of a pattern.
void add_matches(const fs::path& folder, fs::path::const_iterator part, fs::path::const_iterator end,
                 std::vector<fs::path>& found) {
  std::error_code error;
  if (part == end) {
    if (fs::exists(folder, error)) found.push_back(folder);
    return;
  }
  const auto next = std::next(part);
  if (!has_wildcards(*part)) return add_matches(folder / *part, next, end, found);
  const std::string pattern = part->string();
  const fs::path listed = folder.empty() ? fs::path(".") : folder;
  for (fs::directory_iterator at(listed, error), last; !error && at != last; at.increment(error)) {
    const fs::path name = at->path().filename();
    const bool is_hidden = name.string().starts_with('.') && !pattern.starts_with('.');
    if (!is_hidden && matches(name.string(), pattern)) add_matches(folder / name, next, end, found);
  }
}

}  // namespace

bool matches(std::string_view name, std::string_view pattern) {
  std::size_t at = 0, in_pattern = 0, star = pattern.npos, behind_star = 0;
  while (at < name.size()) {
    if (in_pattern < pattern.size() && pattern[in_pattern] == '*') {
      star = in_pattern++;
      behind_star = at;
    } else if (in_pattern < pattern.size() &&
               (pattern[in_pattern] == '?' || pattern[in_pattern] == name[at])) {
      ++in_pattern;
      ++at;
    } else if (star != pattern.npos) {  // the last star takes one character more
      in_pattern = star + 1;
      at = ++behind_star;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', in_pattern) == pattern.npos;
}

std::vector<fs::path> expand_patterns(const std::vector<fs::path>& names) {
  std::vector<fs::path> expanded;
  for (const fs::path& name : names) {
    const auto [pattern, number] = parse_scan_name(name);
    std::error_code ignored;
    if (!has_wildcards(pattern) || fs::exists(pattern, ignored)) {
      expanded.push_back(name);
      continue;
    }
    std::vector<fs::path> found;
    add_matches({}, pattern.begin(), pattern.end(), found);
    if (found.empty())
      throw file_error(name, "matches no file", "Check the spelling and the current directory");
    std::sort(found.begin(), found.end());
    for (fs::path& match : found)
      expanded.push_back(number ? fs::path(match.string() + '#' + std::to_string(*number)) : match);
  }
  return expanded;
}

}  // namespace globalmatch::support

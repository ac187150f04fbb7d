#include "support/programs/survey_inputs.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "support/file_error.hpp"
#include "support/scan_files.hpp"

namespace globalmatch::support {

namespace fs = std::filesystem;

namespace {

/// The folder that all paths lie in.
fs::path common_folder(const std::vector<fs::path>& paths) {
  fs::path common;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const fs::path folder = fs::weakly_canonical(paths[i]).parent_path();
    if (i == 0) {
      common = folder;
      continue;
    }
    fs::path both;
    for (auto a = common.begin(), b = folder.begin(); a != common.end() && b != folder.end() && *a == *b;
         ++a, ++b)
      both /= *a;
    common = both;
  }
  return common;
}

/// Below a folder, without extension.
std::string name_below(const fs::path& path, const fs::path& folder) {
  fs::path below = fs::weakly_canonical(path).lexically_relative(folder);
  below.replace_extension();
  std::string name;
  for (const fs::path& part : below) name += (name.empty() ? "" : "__") + part.string();
  return name;
}

std::string with_number(std::string name, const std::optional<std::size_t>& number) {
  return number ? name + "#" + std::to_string(*number) : name;
}

void set_names(std::vector<survey_input>& inputs) {
  std::map<std::string, std::set<fs::path>> files_of;  // of each short name
  std::vector<fs::path> files;
  for (const survey_input& input : inputs) {
    files.push_back(parse_scan_name(input.path).path);
    files_of[files.back().stem().string()].insert(fs::weakly_canonical(files.back()));
  }
  const fs::path common = common_folder(files);
  std::map<std::string, fs::path> taken;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const auto number = parse_scan_name(inputs[i].path).number;
    const std::string short_name = files[i].stem().string();
    inputs[i].name =
        with_number(files_of[short_name].size() == 1 ? short_name : name_below(files[i], common), number);
    const auto [other, is_new] = taken.emplace(inputs[i].name, inputs[i].path);
    if (!is_new &&
        fs::weakly_canonical(files[i]) != fs::weakly_canonical(parse_scan_name(other->second).path))
      throw file_error(inputs[i].path, "has the same name as " + other->second.string(),
                       "Rename one: results are named by them.");
  }
}

}  // namespace

std::vector<survey_input> named_inputs(const std::vector<fs::path>& paths) {
  std::vector<survey_input> inputs;
  std::set<std::pair<fs::path, std::size_t>> named;
  for (const fs::path& path : paths) {
    const numbered_scan scan = parse_scan_name(path);
    if (named.emplace(fs::weakly_canonical(scan.path), scan.number.value_or(0)).second)
      inputs.push_back({path, {}, {}});
  }
  set_names(inputs);
  std::stable_sort(inputs.begin(), inputs.end(),
                   [](const survey_input& a, const survey_input& b) { return a.name < b.name; });
  return inputs;
}

void hash_inputs(std::vector<survey_input>& inputs, const hash_notes& notes) {
  std::map<fs::path, std::string> hashes;  // of files
  for (survey_input& input : inputs) {
    const numbered_scan scan = parse_scan_name(input.path);
    try {
      auto known = hashes.find(scan.path);
      if (known == hashes.end()) known = hashes.emplace(scan.path, notes.hash_of(scan.path)).first;
      input.hash = with_number(known->second, scan.number);
    } catch (const file_error& e) {
      input.error = e.what();
    }
  }
  std::stable_sort(inputs.begin(), inputs.end(), [](const survey_input& a, const survey_input& b) {
    return a.hash != b.hash ? a.hash < b.hash : a.name < b.name;
  });
  for (std::size_t i = 1; i < inputs.size(); ++i)
    if (!inputs[i].hash.empty() && inputs[i].hash == inputs[i - 1].hash)
      inputs[i].same_as = inputs[i - 1].same_as.value_or(inputs[i - 1].name);
}

survey_matches::part parse_part(const std::string& text) {
  if (text.empty()) return {};
  std::size_t own = 0, parts = 0;
  char slash = 0;
  std::istringstream in(text);
  if (!(in >> own >> slash >> parts) || slash != '/' || !in.eof() || own < 1 || own > parts)
    throw std::invalid_argument("--part " + text + ": I/N is needed, I from 1 to N");
  return {own - 1, parts};
}

std::string name_of(const survey_matches::part& part) {
  return std::to_string(part.number + 1) + "_of_" + std::to_string(part.count);
}

std::vector<survey_input> part_of(std::vector<survey_input> inputs, const survey_matches::part& part) {
  std::vector<survey_input> chosen;
  for (std::size_t i = part.number; i < inputs.size(); i += part.count)
    chosen.push_back(std::move(inputs[i]));
  return chosen;
}

}  // namespace globalmatch::support

// Scans by the names that files of truth give them.
#pragma once

#include "support/scan_sets.hpp"
#include "support/text_fields.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

/// The digits at the end of a name without leading zeros, as 3 of scan_03; empty where there are none.
inline std::string trailing_number(std::string_view name) {
  std::size_t first = name.size();
  while (first > 0 && std::isdigit(static_cast<unsigned char>(name[first - 1]))) --first;
  while (first + 1 < name.size() && name[first] == '0') ++first;
  return std::string(name.substr(first));
}

/// Names of the scans of a plot.
class scan_names {
 public:
  explicit scan_names(const std::vector<std::filesystem::path>& scans) {
    for (const auto& scan : scans) {
      names_.push_back(support::name_of(scan));
      files_.push_back(scan.filename().string());
    }
  }

  std::size_t size() const { return names_.size(); }
  const std::string& operator[](std::size_t scan) const { return names_[scan]; }
  const std::vector<std::string>& all() const { return names_; }

  /// The scan of a name or of a file's name, perhaps behind folders; else the one whose name begins with it,
  /// as s2 of s2_v0.1.pcd; else the one whose name ends with that number; else that of the name in other
  /// letters, capital or small. Nothing where there is none, or more than one.
  std::optional<std::size_t> find(std::string_view path) const {
    const std::size_t folders = path.find_last_of("/\\");
    const std::string_view name = folders == path.npos ? path : path.substr(folders + 1);
    const auto by = [&](const auto& is_it) {
      std::vector<std::size_t> found;
      for (std::size_t i = 0; i < names_.size(); ++i)
        if (is_it(i)) found.push_back(i);
      return found;
    };
    auto found = by([&](std::size_t i) { return names_[i] == name || files_[i] == name; });
    if (found.empty()) found = by([&](std::size_t i) { return begins(names_[i], name); });
    if (found.empty() && is_number(name))
      found = by([&](std::size_t i) { return trailing_number(names_[i]) == trailing_number(name); });
    if (found.empty())
      found = by([&](std::size_t i) {
        const std::string low = support::lower_case(std::string(name));
        return support::lower_case(names_[i]) == low || support::lower_case(files_[i]) == low;
      });
    return found.size() == 1 ? std::optional(found[0]) : std::nullopt;
  }

  /// Source and target of a name like A-B or A_B.
  std::optional<std::pair<std::size_t, std::size_t>> find_pair(std::string_view name) const {
    for (std::size_t at = name.find_first_of("-_ "); at != name.npos;
         at = name.find_first_of("-_ ", at + 1)) {
      const auto source = find(name.substr(0, at)), target = find(name.substr(at + 1));
      if (source && target && *source != *target) return std::pair(*source, *target);
    }
    return std::nullopt;
  }

 private:
  static bool begins(std::string_view whole, std::string_view name) {
    return !name.empty() && whole.size() > name.size() && whole.starts_with(name) &&
           !std::isalnum(static_cast<unsigned char>(whole[name.size()]));
  }
  static bool is_number(std::string_view text) {
    return !text.empty() &&
           std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
  }

  std::vector<std::string> names_, files_;
};

}  // namespace globalmatch::benchmarks

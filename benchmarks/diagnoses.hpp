// What a user is told of two stem maps.
#pragma once

#include <globalmatch/stem_matching.hpp>

#include "stem_layouts.hpp"
#include "support/atomic_file.hpp"
#include "support/file_error.hpp"
#include "support/programs/reports.hpp"
#include "support/stem_files.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace globalmatch::benchmarks {

/// What was said of two maps: warnings, a reason that asks what is wrong, and why a file is not read.
struct diagnosis {
  matching result;
  std::vector<support::warning> said;

  bool says(std::string_view code, std::string_view text) const {
    return std::any_of(said.begin(), said.end(), [&](const support::warning& w) {
      return w.code == code && w.text.find(text) != std::string::npos;
    });
  }
};

inline void write_map(const std::filesystem::path& file, const positions& stems, std::string_view columns) {
  support::atomic_file csv(file);
  csv.stream() << columns << '\n';
  for (const Eigen::Vector3d& p : stems) csv.stream() << p.x() << ',' << p.y() << ',' << p.z() << '\n';
  csv.commit();
}

/// Whether more than one in ten stems are at the place of another one: forked trees are fewer.
inline bool are_many(std::size_t coincident, std::size_t stems) {
  return 10 * coincident > stems;
}

/// Reads and matches two maps as the program match_stems does.
inline diagnosis diagnose(const std::filesystem::path& source_file, const std::filesystem::path& target_file,
                          bool scale) {
  diagnosis d;
  try {
    const auto source = support::read_stems(source_file), target = support::read_stems(target_file);
    d.said = support::warnings_of(source);
    const bool horizontal = !source.has_heights || !target.has_heights;
    d.result = match_stems(source.stems, target.stems, {.horizontal = horizontal, .scale = scale});
    for (const auto& warnings : {support::warnings_of(target), support::warnings_of(d.result)})
      d.said.insert(d.said.end(), warnings.begin(), warnings.end());
    if (d.result.reason.find('?') != std::string::npos) d.said.push_back({"reason", d.result.reason});
  } catch (const support::file_error& e) {
    d.said.push_back({"file", e.what()});
  }
  const matching_funnel& f = d.result.funnel;
  if (!are_many(f.source_coincident, f.source_stems) && !are_many(f.target_coincident, f.target_stems))
    std::erase_if(d.said, [](const support::warning& w) { return w.code == "coincident_stems"; });
  return d;
}

/// Whether stems end, on average, less than 0.3 m in plan from where they belong.
inline bool is_right_in_plan(const matching& result, const positions& source, const positions& ends) {
  const auto transform = support::with_scale(result);
  if (!transform) return false;
  const std::size_t size = std::min(source.size(), ends.size());  // copies follow
  double sum = 0;
  for (std::size_t i = 0; i < size; ++i) sum += (*transform * source[i] - ends[i]).head<2>().norm();
  return sum < 0.3 * double(size);
}

}  // namespace globalmatch::benchmarks

// The links that single maps asked for, as bytes and back: what processes that share the matching of a survey
// exchange. Structured bindings name all fields: one that is added and not named here does not compile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/byte_archives.hpp"
#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// The links of one map by its own candidates.
struct map_links {
  std::uint32_t map = 0;
  std::size_t tried = 0;  ///< candidates
  std::vector<survey_link> links = {};
};

template <class Archive, either_const<vec2> V>
void serialize(Archive& archive, V& value) {
  archive(value.x, value.y);
}

template <class Archive, either_const<mat3> V>
void serialize(Archive& archive, V& value) {
  for (auto& column : value.columns) archive(column.x, column.y, column.z);
}

template <class Archive, either_const<correspondence> V>
void serialize(Archive& archive, V& value) {
  archive(value.source, value.target);
}

/// All but what later rounds say of a link, which is by stems.
template <class Archive, either_const<survey_link> V>
void serialize(Archive& archive, V& value) {
  [[maybe_unused]] auto& [source, target, pose, center, covariance, log10_nfa, inlier_threshold, rms,
                          correspondences, targets, target_raise, supporting_cycles, used] = value;
  archive(source, target, pose.shift, pose.yaw, center, covariance, log10_nfa, inlier_threshold, rms,
          correspondences);
}

inline std::string bytes_of(const map_links& found) {
  output_archive archive;
  archive.count(found.tried);
  archive(found.links);
  return std::move(archive).bytes();
}

/// Throws `std::invalid_argument` for bytes that are not links of that map to others of the survey.
inline map_links map_links_of(std::uint32_t map, std::string_view bytes,
                              std::span<const prepared_stems> maps) {
  map_links found{map};
  try {
    input_archive archive(bytes, "matches: the links of a map");
    archive.count(found.tried);
    archive(found.links);
    archive.finish();
    for (const survey_link& l : found.links) {
      if (l.source != map || l.target >= maps.size() || l.target == map) archive.fail("are of other maps");
      for (const correspondence& c : l.correspondences)
        if (c.source >= maps[map].stems.size() || c.target >= maps[l.target].stems.size())
          archive.fail("are of other stems");
    }
  } catch (const std::runtime_error& e) {
    throw std::invalid_argument(e.what());
  }
  return found;
}

/// 64 bits that differ where positions, or what is known of them, do. `asked`: the question of the matching.
inline std::uint64_t fingerprint_of(std::span<const prepared_stems> maps, double asked) {
  output_archive archive;
  std::uint64_t hash = maps.size();
  const auto mix = [&hash](const std::string& bytes) {
    for (std::size_t i = 0; i < bytes.size(); i += sizeof(hash)) {
      char word[sizeof(hash)] = {};
      bytes.copy(word, sizeof(word), i);
      hash = random_source(hash + load_little_endian<std::uint64_t>(word)).next();
    }
  };
  archive(asked);
  mix(archive.bytes());
  for (const prepared_stems& map : maps) {
    const position_set& s = map.stems;
    output_archive of_map;
    of_map.count(s.size());
    for (const vec3& p : s.at) of_map(p.x, p.y, p.z);
    of_map(s.sigma, s.radius, s.height_sigma, s.has_heights, s.cell_area);
    mix(of_map.bytes());
  }
  return hash;
}

}  // namespace globalmatch::detail

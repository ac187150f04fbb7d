// The bytes of stem map files, and a small map, for tests that damage them.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "globalmatch/detail/core/crc32c.hpp"
#include "globalmatch/detail/core/little_endian.hpp"
#include "globalmatch/stem_map_io.hpp"

namespace globalmatch {

inline std::string bytes_of(const stem_map& map, const stem_map_file::scan_record& provenance = {}) {
  std::ostringstream out;
  write_stem_map(out, map, provenance);
  return out.str();
}

inline stem_map_file read_back(const std::string& bytes,
                               stem_map_file::parts parts = stem_map_file::parts::all) {
  std::istringstream in(bytes);
  return read_stem_map(in, parts);
}

/// What `read_stem_map` says about these bytes; empty when it reads them.
inline std::string error_of(const std::string& bytes,
                            stem_map_file::parts parts = stem_map_file::parts::all) {
  try {
    read_back(bytes, parts);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return {};
}

inline bool says(const std::string& message, std::string_view words) {
  return message.find(words) != std::string::npos;
}

inline const stem_map_file::scan_record some_provenance = {"plot 7/scan_1.laz", "xxh3:0123456789abcdef",
                                                           "{\"min_quality\": 0.6}", "0.1.0", "x86-64-v2"};

/// A map in which every field but the large one, `visible`, differs from its default, without the
/// mathematical functions of a platform.
inline stem_map map_of_one_stem() {
  stem_map map;
  stem s;
  s.position = {1.5, -2.25, 0.1};
  s.axis = {0, 0.6, 0.8};
  s.radius = 0.14;
  s.radius_sigma = 0.01;
  s.taper = 0.02;
  s.position_sigma = 0.03;
  s.height_sigma = 0.04;
  s.quality = 0.95;
  s.ground_seen = false;
  s.ground_points = 17;
  s.support = {3, 5};
  map.stems = {s};
  terrain& t = map.terrain;
  t.frame.origin = {500'000.125, 5'300'000.25, 400.1};
  t.resolution = 0.5;
  t.columns = 3;
  t.rows = 2;
  t.heights = {0.1f, -0.2f, 0.3f, -0.0f, 1e-30f, 7};
  t.has_data = {1, 0, 1, 1, 0, 1};
  t.in_surface = {0, 1, 0, 0, 1, 1};
  t.ground = {{0.1f, 0.2f, 0.3f}, {0.7f, 0.1f, -0.1f}};
  t.first_ground = {0, 1, 2, 2, 2, 2, 2};
  t.status = ground_status::normalised;
  t.cut_off = true;
  map.ground_samples = detail::samples_of(t.ground, t.frame);
  map.stem_samples = detail::samples_of({{0.123f, 0.456f, 1.789f}, {0, -1, 2}}, t.frame);
  map.stem_normals = {{0.6, 0.8, 0}, {0, 1, 0}};
  map.up = {0.6, 0, 0.8};
  map.given_up = {0, 0.6, 0.8};
  map.up_by_stems = true;
  map.upright = upright_direction{{0.6, 0, 0.8}, 0.01};
  map.spacing_near = 0.011;
  map.spacing_far = 0.022;
  map.distance_tolerance = 0.033;
  map.funnel = {{1, 2, 3, 4, 5, 6, 7, 8, 0.25}, 9, false, 10, 11, 12, 13, 14, 15};
  map.cancelled = true;
  return map;
}

/// Where the parts of a stem map file begin.
struct stem_map_layout {
  static constexpr std::size_t sections = 7, entries = 16, entry_size = 16;
  static constexpr std::size_t table_end = entries + sections * entry_size, contents = table_end + 4;

  static std::size_t length_at(std::size_t section) { return entries + section * entry_size + 8; }
  static std::size_t length(const std::string& bytes, std::size_t section) {
    return static_cast<std::size_t>(detail::load_little_endian<std::uint64_t>(&bytes[length_at(section)]));
  }
  static std::size_t begin(const std::string& bytes, std::size_t section) {
    std::size_t at = contents;
    for (std::size_t i = 0; i < section; ++i) at += length(bytes, i);
    return at;
  }
};

/// Makes all checksums fit whatever the file holds, as far as it goes.
inline void seal_stem_map(std::string& bytes) {
  using layout = stem_map_layout;
  if (bytes.size() < layout::contents) return;
  std::size_t at = layout::contents;
  for (std::size_t i = 0; i < layout::sections && at <= bytes.size(); ++i) {
    const std::size_t length = layout::length(bytes, i);
    const auto content = std::string_view(bytes).substr(at, length);
    detail::store_little_endian(detail::crc32c(content), &bytes[layout::length_at(i) - 4]);
    if (length > bytes.size() - at) break;
    at += length;
  }
  const auto table = std::string_view(bytes).substr(0, layout::table_end);
  detail::store_little_endian(detail::crc32c(table), &bytes[layout::table_end]);
}

}  // namespace globalmatch

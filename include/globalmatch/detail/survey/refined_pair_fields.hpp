// Which fields of a refined pair are written, and in which order.
#pragma once

#include <Eigen/Geometry>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>

#include "globalmatch/detail/core/byte_archives.hpp"
#include "globalmatch/detail/core/checked_sections.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/refinement_options.hpp"

namespace globalmatch::detail {

inline constexpr std::array<std::string_view, 1> refined_pair_sections = {"pair"};
inline constexpr sections_format refined_pair_format = {"\x89GMRP\r\n\n", "refined pair", 1, 1,
                                                        refined_pair_sections};

template <class Archive, class V>
void serialize_transform(Archive& archive, V& value) {
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 3; ++r) archive(value.matrix()(r, c));
}

template <class Archive, either_const<transform_uncertainty> V>
void serialize_uncertainty(Archive& archive, V& value) {
  std::uint8_t size = std::uint8_t(value.covariance.rows());
  archive(size);
  if constexpr (!std::is_const_v<V>) {
    if (size != 0 && size != 4 && size != 6) archive.fail("holds a covariance of a size that there is not");
    value.covariance.resize(size, size);
  }
  for (int k = 0; k < 3; ++k) archive(value.center[k]);
  for (int k = 0; k < 3; ++k) archive(value.up[k]);
  for (int c = 0; c < int(size); ++c)
    for (int r = 0; r < int(size); ++r) archive(value.covariance(r, c));
}

template <class Archive, either_const<pair_to_refine> V>
void serialize(Archive& archive, V& value) {
  auto& [source, target, target_from_source, uncertainty, is_height_known] = value;
  archive.count(source);
  archive.count(target);
  serialize_transform(archive, target_from_source);
  serialize_uncertainty(archive, uncertainty);
  archive(is_height_known);
}

template <class Archive, either_const<refined_pair> V>
void serialize(Archive& archive, V& value) {
  auto& [start, target_from_source, uncertainty, is_refined, is_height_refined, tilt_sigma, samples, rms,
         reason, provenance] = value;
  archive(start);
  serialize_transform(archive, target_from_source);
  serialize_uncertainty(archive, uncertainty);
  archive(is_refined, is_height_refined, tilt_sigma, rms, reason, provenance);
  archive.count(samples);
}

}  // namespace globalmatch::detail

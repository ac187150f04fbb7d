// Which fields of a stem map are written, and in which order. Structured bindings name all fields of each
// struct: one that is added and not named here does not compile.
#pragma once

#include <Eigen/Core>

#include <type_traits>

#include "globalmatch/detail/core/byte_archives.hpp"
#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

template <class Archive, class V>
requires either_const<V, vec3> || either_const<V, vec3f>
void serialize(Archive& archive, V& value) {
  archive(value.x, value.y, value.z);
}

template <class Archive, either_const<Eigen::Vector3d> V>
void serialize(Archive& archive, V& value) {
  archive(value[0], value[1], value[2]);
}

/// The rotation column by column.
template <class Archive, either_const<local_frame> V>
void serialize(Archive& archive, V& value) {
  auto& [origin, rotation] = value;
  archive(origin, rotation.columns[0], rotation.columns[1], rotation.columns[2]);
}

/// All but the support.
template <class Archive, either_const<stem> V>
void serialize(Archive& archive, V& value) {
  [[maybe_unused]] auto& [position, axis, radius, radius_sigma, taper, position_sigma, height_sigma, quality,
                          ground_seen, ground_points, support] = value;
  archive(position, axis, radius, radius_sigma, taper, position_sigma, height_sigma, quality, ground_seen,
          ground_points);
}

template <class Archive, either_const<ground_funnel> V>
void serialize(Archive& archive, V& value) {
  auto& [points, not_finite, low_points, cells, cells_apart, low_outliers, unreachable, ground_points,
         coordinate_step] = value;
  for (auto* const count :
       {&points, &not_finite, &low_points, &cells, &cells_apart, &low_outliers, &unreachable, &ground_points})
    archive.count(*count);
  archive(coordinate_step);
}

template <class Archive, either_const<mapping_funnel> V>
void serialize(Archive& archive, V& value) {
  auto& [ground, understory, by_cells, thinned, stem_points, clusters, cylinders, likely, stems] = value;
  archive(ground, by_cells);
  for (auto* const count : {&understory, &thinned, &stem_points, &clusters, &cylinders, &likely, &stems})
    archive.count(*count);
}

template <class Archive, either_const<upright_direction> V>
void serialize(Archive& archive, V& value) {
  auto& [up, sigma] = value;
  archive(up, sigma);
}

/// What is neither a stem nor terrain nor a sample.
template <class Archive, either_const<stem_map> V>
void serialize_summary(Archive& archive, V& map) {
  bool has_upright = map.upright.has_value();
  archive(map.cancelled, map.up, map.given_up, map.up_by_stems, has_upright);
  auto upright = map.upright.value_or(upright_direction());
  archive(upright, map.spacing_near, map.spacing_far, map.distance_tolerance, map.funnel);
  if constexpr (!std::is_const_v<V>) {
    if (has_upright) map.upright = upright;
  }
}

/// The terrain but for its ground points.
template <class Archive, either_const<terrain> V>
void serialize_raster(Archive& archive, V& value) {
  archive(value.frame, value.resolution, value.columns, value.rows, value.cut_off);
  archive.choice(value.status, ground_status::normalised);
  archive(value.heights, value.has_data, value.in_surface);
}

template <class Archive, either_const<visible_ranges> V>
void serialize_view(Archive& archive, V& value) {
  auto& [scanner, ranges] = value;
  archive(scanner, ranges);
}

template <class Archive, either_const<terrain> V>
void serialize_ground(Archive& archive, V& value) {
  archive(value.ground, value.first_ground);
}

}  // namespace globalmatch::detail

// Fine registration of two stem maps by their samples: ground on ground, stems on stems.
#pragma once

#include <Eigen/Geometry>

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/ground_offset.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/icp.hpp"
#include "globalmatch/icp_options.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// The origin of the terrain's frame, with the vertical of the map.
inline local_frame levelled_frame(const stem_map& map) {
  return {map.terrain.frame.origin, levelling_rotation(from_eigen(map.up))};
}

/// The transform between the levelled frames of two maps.
inline rigid between_levelled(const stem_map& source, const stem_map& target,
                              const Eigen::Isometry3d& target_from_source) {
  return levelled_frame(target).local_from_scan() * from_eigen(target_from_source) *
         levelled_frame(source).local_from_scan().inverse();
}

/// Ground samples under a transform from the levelled frame of the map; where the ground was cut off, those
/// that lie in a surface.
inline std::vector<vec3> sure_ground(const stem_map& map, const rigid& transform) {
  const local_frame levelled = levelled_frame(map);
  std::vector<vec3> ground;
  for (const Eigen::Vector3d& sample : map.ground_samples) {
    const vec3 p = from_eigen(sample), local = map.terrain.frame.to_local(p);
    const bool is_sure =
        !map.terrain.cut_off || (map.terrain.covers(local.x, local.y) && !map.terrain.in_surface.empty() &&
                                 map.terrain.is_in_surface(local.x, local.y));
    if (is_sure) ground.push_back(transform * levelled.to_local(p));
  }
  return ground;
}

/// Why the ground does not give the height between two maps, whatever they see of it; empty where it may.
inline std::string why_without_ground(const stem_map& source, const stem_map& target) {
  for (const auto& [map, name] : {std::pair(&source, "source"), std::pair(&target, "target")})
    if (map->terrain.status == ground_status::none)
      return std::string(name) +
             " shows no ground; the height of the transform is a guess, which a scan with its ground mends";
  if ((source.terrain.status == ground_status::normalised) !=
      (target.terrain.status == ground_status::normalised))
    return "heights of one scan are those above the ground; that of the transform is a guess";
  return "";
}

/// How far apart the ground is that both maps see under a transform.
inline std::optional<ground_offset> offset_of_ground(const stem_map& source, const stem_map& target,
                                                     const Eigen::Isometry3d& target_from_source) {
  return find_ground_offset(sure_ground(source, between_levelled(source, target, target_from_source)),
                            sure_ground(target, {}));
}

/// Samples of a map in its levelled frame.
struct levelled_samples {
  std::vector<vec3> ground, stems, stem_normals;

  levelled_samples(const stem_map& map, const local_frame& frame) : ground(sure_ground(map, {})) {
    for (const Eigen::Vector3d& p : map.stem_samples) stems.push_back(frame.to_local(from_eigen(p)));
    if (map.stem_normals.size() != map.stem_samples.size()) return;
    for (const Eigen::Vector3d& n : map.stem_normals) stem_normals.push_back(frame.rotation * from_eigen(n));
  }
};

/// ICP over the samples of both maps, in their levelled frames: stems on stems and, where it shall move the
/// height as well, ground on ground. It turns freely where a vertical is the stems', which is good to some
/// tenths of a degree. `uncertainty`, where it is asked for, is in the levelled frame of the target.
inline icp_result refine_by_samples(const stem_map& source, const stem_map& target,
                                    const Eigen::Isometry3d& coarse, degrees_of_freedom dof, bool uses_ground,
                                    const icp_options& options, const execution& exec,
                                    icp_uncertainty* uncertainty = nullptr) {
  const local_frame source_frame = levelled_frame(source), target_frame = levelled_frame(target);
  levelled_samples from(source, source_frame), to(target, target_frame);
  if (from.stem_normals.empty() || to.stem_normals.empty()) from.stem_normals = to.stem_normals = {};
  std::vector<icp_samples> layers(2);
  if (uses_ground) layers[0] = {std::move(from.ground), std::move(to.ground), {}, {}};
  layers[1] = {std::move(from.stems), std::move(to.stems), std::move(from.stem_normals),
               std::move(to.stem_normals)};
  if (source.up_by_stems || target.up_by_stems) dof = degrees_of_freedom::six;
  const rigid source_local = source_frame.local_from_scan(), target_local = target_frame.local_from_scan();
  icp_result result = refine_samples(std::move(layers), between_levelled(source, target, coarse), dof,
                                     options, exec, uncertainty);
  result.target_from_source =
      to_eigen(target_local.inverse() * from_eigen(result.target_from_source) * source_local);
  return result;
}

}  // namespace globalmatch::detail

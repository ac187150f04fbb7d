// Samples in half the bytes, exactly. Where the vertical is +z, mapping makes them from local floats p as
// p + origin, which is rounded once and so has the same bits on every processor: the floats are written.
// Other samples are written as they are: where a frame is rotated, processors round differently.
#pragma once

#include <Eigen/Core>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "globalmatch/detail/core/byte_archives.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/stem_map_io/stem_map_fields.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

inline bool have_same_bits(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  using bits = std::uint64_t;
  return std::bit_cast<bits>(a[0]) == std::bit_cast<bits>(b[0]) &&
         std::bit_cast<bits>(a[1]) == std::bit_cast<bits>(b[1]) &&
         std::bit_cast<bits>(a[2]) == std::bit_cast<bits>(b[2]);
}

/// A sample [m], frame of the scan, by the expression with which mapping makes it.
inline Eigen::Vector3d sample_of(const vec3f& local, const local_frame& frame) {
  return to_eigen(frame.to_scan(vec3(local)));
}

inline std::vector<Eigen::Vector3d> samples_of(const std::vector<vec3f>& local, const local_frame& frame) {
  std::vector<Eigen::Vector3d> samples;
  samples.reserve(local.size());
  for (const vec3f& p : local) samples.push_back(sample_of(p, frame));
  return samples;
}

/// Whether `samples_of` gives these samples, bit for bit on every processor.
inline bool are_samples_of(const std::vector<vec3f>& local, const local_frame& frame,
                           const std::vector<Eigen::Vector3d>& samples) {
  if (!(frame.rotation == mat3::identity()) || samples.size() != local.size()) return false;
  for (std::size_t i = 0; i < local.size(); ++i)
    if (!have_same_bits(sample_of(local[i], frame), samples[i])) return false;
  return true;
}

inline void write_samples(output_archive& archive, const std::vector<Eigen::Vector3d>& samples,
                          const local_frame& frame) {
  std::vector<vec3f> local;
  local.reserve(samples.size());
  for (const Eigen::Vector3d& p : samples) local.emplace_back(frame.to_local(from_eigen(p)));
  const bool is_local = are_samples_of(local, frame, samples);
  archive(is_local);
  if (is_local)
    archive(local);
  else
    archive(samples);
}

inline void read_samples(input_archive& archive, std::vector<Eigen::Vector3d>& samples,
                         const local_frame& frame) {
  bool is_local = false;
  archive(is_local);
  if (!is_local) return archive(samples);
  std::vector<vec3f> local;
  archive(local);
  samples = samples_of(local, frame);
}

/// All samples of a map and the normals of those on stems.
inline void write_samples(output_archive& archive, const stem_map& map) {
  const terrain& t = map.terrain;
  const bool by_ground = are_samples_of(t.ground, t.frame, map.ground_samples);
  archive(by_ground);
  if (!by_ground) write_samples(archive, map.ground_samples, t.frame);
  write_samples(archive, map.stem_samples, t.frame);
  archive(map.stem_normals);
}

/// What `write_samples` wrote, for a map whose terrain has its ground points.
inline void read_samples(input_archive& archive, stem_map& map) {
  const terrain& t = map.terrain;
  bool by_ground = false;
  archive(by_ground);
  if (by_ground)
    map.ground_samples = samples_of(t.ground, t.frame);
  else
    read_samples(archive, map.ground_samples, t.frame);
  read_samples(archive, map.stem_samples, t.frame);
  archive(map.stem_normals);
}

}  // namespace globalmatch::detail

// Internal to the LAZ reader and writer: what records and chunks consist of.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "support/las_header.hpp"

namespace globalmatch::support::laz {

/// The layers that formats 6 to 8 have of all points, in the order of the file. Those of colours, near
/// infrared and each extra byte follow.
enum point_layer : std::size_t {
  xy_layer,
  z_layer,
  class_layer,
  flags_layer,
  intensity_layer,
  scan_angle_layer,
  user_data_layer,
  source_layer,
  time_layer,
  point_layers
};

/// What the records of a file consist of.
struct record_layout {
  unsigned format;          ///< of the points: 0 to 3, or 6 to 8, which are coded in layers
  std::size_t extra_bytes;  ///< of a record, behind those that its format has
  unsigned version;         ///< of the coding of formats 6 to 8: 3 or 4

  bool is_layered() const { return format >= 6; }
  bool has_time() const { return format == 1 || format == 3 || format >= 6; }
  bool has_color() const { return format == 2 || format == 3 || format >= 7; }
  bool has_infrared() const { return format == 8; }
  std::size_t record_size() const {
    const std::size_t point = is_layered() ? 30 : 20 + 8 * has_time();
    return point + 6 * has_color() + 2 * has_infrared() + extra_bytes;
  }

  std::size_t layers() const { return point_layers + has_color() + has_infrared() + extra_bytes; }
  /// [bytes] at the start of a layered chunk: the first record, the number of points, the sizes of layers.
  std::size_t header_size() const { return record_size() + 4 + 4 * layers(); }

  /// Layers from the first that coordinates and marks need.
  static constexpr std::size_t coordinate_layers = flags_layer + 1;
};

/// The items of a record as current compressors code them.
std::vector<laszip_record::item> laszip_items(const record_layout& layout);

/// Points of a file that are coded together.
struct chunk {
  std::uint64_t offset, size;  ///< [bytes] in the file
  std::uint64_t first, count;  ///< points
};

}  // namespace globalmatch::support::laz

// Internal to the E57 reader: what the XML of an E57 file says about its scans.
#pragma once

#include <Eigen/Geometry>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "support/e57_pages.hpp"
#include "support/numbered_scans.hpp"

namespace globalmatch::support {

/// One number of each point.
struct e57_field {
  enum class number { float32, float64, integer };

  std::size_t stream = 0;  ///< which of the scan's byte streams holds it
  number type = number::float64;
  unsigned bits = 64;  ///< of each value; 0 where all are the minimum
  std::int64_t minimum = 0;
  double scale = 1, offset = 0;  ///< of integers: the value is (minimum + bits) * scale + offset
};

/// One scan, and where its points are.
struct e57_scan {
  std::uint64_t section = 0;  ///< [bytes] in the file
  std::uint64_t size = 0;     ///< in points
  std::size_t streams = 0;    ///< one for each field
  bool is_spherical = false;  ///< range, azimuth and elevation [rad] in place of x, y and z
  std::array<e57_field, 3> coordinates;
  std::optional<e57_field> invalid_state;                  ///< of the coordinates; 0 where they are valid
  std::optional<Eigen::Isometry3d> pose;                   ///< survey_from_file
  std::vector<std::string> attributes;                     ///< names of all other fields
  std::vector<std::pair<std::string, e57_field>> numbers;  ///< those of them that are numbers
};

/// The scans of a file, in its order. Elements of `data3D` without points are none.
class e57_description {
 public:
  /// Throws `file_error` when the XML is damaged, or this was built without pugixml.
  explicit e57_description(const e57_pages& pages);
  ~e57_description();
  e57_description(const e57_description&) = delete;
  e57_description& operator=(const e57_description&) = delete;

  std::size_t scans() const;
  /// Scan `number`, counted from 1. Throws `file_error` when there is none, or it has no coordinates.
  e57_scan scan(std::size_t number) const;
  /// The XML with other poses of some scans. Throws as `scan`.
  std::string xml_with_poses(std::span<const scan_pose> poses) const;

 private:
  struct document;
  void require_scan(std::size_t number) const;

  const e57_pages& pages_;
  std::unique_ptr<document> document_;
};

}  // namespace globalmatch::support

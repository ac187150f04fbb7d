// Internal to `write_scans`: how points become records, and all points of scans do.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "support/record_fields.hpp"
#include "support/scan_writer.hpp"

namespace globalmatch::support {

/// An attribute of a scan, and where it goes.
struct mapped_field {
  std::size_t index;  ///< in the attributes of the scan
  attribute from;     ///< how it is stored there
  record_field to;
};

/// What the records of a scan consist of.
struct scan_records {
  std::string prototype;  ///< a record with what is the same in all
  std::vector<mapped_field> fields;
};

/// Puts not-a-number in the prototype of a scan for the fields that it does not have, if they hold it:
/// integers stay 0.
void put_missing(std::span<const record_field> fields, scan_records& scan);

/// Coordinates as integers * scale + offset, of 32 bits each.
struct coordinate_grid {
  Eigen::Vector3d scale, offset;
};

/// What the records of a file consist of. They start with the coordinates.
struct output_records {
  std::size_t record_size = 0;
  std::optional<coordinate_grid> grid;  ///< none: coordinates are doubles
  std::vector<scan_records> scans;
};

/// How many points are not left out, and where they are.
struct points_extent {
  std::size_t count = 0;
  Eigen::Vector3d min = Eigen::Vector3d::Constant(INFINITY), max = Eigen::Vector3d::Constant(-INFINITY);
};
points_extent extent_of(const placed_scan& scan, int threads);

/// Calls `use` with the records of all points in their order, some at a time.
void for_each_record(std::span<const placed_scan> scans, const output_records& layout, int threads,
                     const std::function<void(std::span<const char>)>& use);

}  // namespace globalmatch::support

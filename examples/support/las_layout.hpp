// Internal to `write_scans`: the LAS file that holds some scans.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "support/output_records.hpp"
#include "support/scan_writer.hpp"

namespace globalmatch::support {

struct las_layout {
  unsigned format = 0;         ///< of the point records
  unsigned minor_version = 2;  ///< of version 1
  std::uint16_t encoding = 0;
  std::vector<std::pair<std::uint16_t, std::string>> projection;
  std::vector<record_field> extra_fields;
  output_records records;
};

/// Chooses the point format, the steps of coordinates and the place of each attribute. Throws `file_error`
/// for `path` when 32 bits cannot hold the coordinates, or there are more attributes than LAS can describe.
las_layout make_las_layout(const std::filesystem::path& path, std::span<const placed_scan> scans,
                           const points_extent& extent, int threads);

}  // namespace globalmatch::support

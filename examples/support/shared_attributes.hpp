// Internal to `write_scans`: which attributes scans have, and what they are in a file of all of them.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "support/point_attributes.hpp"
#include "support/scan_writer.hpp"

namespace globalmatch::support {

/// An attribute as one scan has it.
struct scan_attribute {
  std::size_t index = 0;  ///< in the attributes of the scan
  attribute what;
};

/// An attribute that some of the scans have.
struct shared_attribute {
  std::string name;                                    ///< that of LAS, or of the file
  std::vector<std::optional<scan_attribute>> of_scan;  ///< none where a scan does not have it
};

/// The attributes of all scans, without those of the same name twice. Of two in one scan the second gets
/// another name.
std::vector<shared_attribute> share_attributes(std::span<const placed_scan> scans);

/// A type that stores all values of the attribute: that of the files if they have the same, with their scale
/// and offset if `keep_scale`.
attribute common_storage(const shared_attribute& shared, bool keep_scale);

/// The values of an attribute in a scan.
struct value_range {
  double min = 0, max = 0;
  bool is_whole = true;  ///< all values are integers

  void include(const value_range& other);
};
value_range range_of(const scan_file& scan, const scan_attribute& of, int threads);

}  // namespace globalmatch::support

// Internal to `open_scan`: the LAS format and its compressed kinds.
#pragma once

#include "support/input_file.hpp"
#include "support/point_source.hpp"

namespace globalmatch::support {

/// LAS 1.0 to 1.4, compressed (LAZ, COPC) or not. Points of the classes 7 and 18 (noise) and withheld ones
/// are left out unless they are to be kept. Points that are not compressed are read when they are asked for.
/// Throws `file_error` when the file is damaged, or compressed point by point (before LASzip 2.0) or with
/// wave packets.
opened_scan open_las(input_file& file, const scan_options& options);

}  // namespace globalmatch::support

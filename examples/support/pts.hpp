// Internal to the readers: PTS, the text format of Leica whose blocks of points begin with their count.
#pragma once

#include <cstddef>
#include <string_view>

#include "support/input_file.hpp"
#include "support/point_source.hpp"

namespace globalmatch::support {

/// Whether the first lines of a file are a count of points, and a point or the count of another block.
bool looks_like_pts(std::string_view start);

/// The block `number`, counted from 1. Throws `file_error`, also when the block holds other than the points
/// that its count announces.
opened_scan open_pts(input_file& file, std::size_t number, const scan_options& options);

}  // namespace globalmatch::support

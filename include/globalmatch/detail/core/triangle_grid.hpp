// Triangles, found by their edge lengths.
#pragma once

#include <array>
#include <cstdint>

#include "globalmatch/detail/core/wrapped_grid.hpp"

namespace globalmatch::detail {

/// Three indices each, such as vertices, found by the edge lengths [m].
using triangle_grid = wrapped_grid<float, 3, std::array<std::uint32_t, 3>>;

}  // namespace globalmatch::detail

// Colours of scans: those of Okabe and Ito, which are distinct with any colour vision.
#pragma once

#include <array>
#include <cstddef>

#include "support/scan_files.hpp"

namespace globalmatch::support {

inline constexpr rgb source_scan_colour = {213, 94, 0}, target_scan_colour = {0, 114, 178};

/// Of a survey, over and over.
inline rgb scan_colour_of(std::size_t scan) {
  constexpr std::array<rgb, 7> colours = {{{0, 114, 178},
                                           {230, 159, 0},
                                           {0, 158, 115},
                                           {204, 121, 167},
                                           {86, 180, 233},
                                           {213, 94, 0},
                                           {240, 228, 66}}};
  return colours[scan % colours.size()];
}

}  // namespace globalmatch::support

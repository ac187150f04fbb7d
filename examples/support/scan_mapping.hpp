// Mapping of scan files, compiled once for all programs.
#pragma once

#include <Eigen/Core>

#include <globalmatch/stem_mapping.hpp>

#include "support/scan_files.hpp"

namespace globalmatch {

extern template stem_map map_stems(const support::scan_file& scan, const mapping_options& options,
                                   const Eigen::Vector3d& up, const execution& exec);

}  // namespace globalmatch

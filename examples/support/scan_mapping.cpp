#include "support/scan_mapping.hpp"

namespace globalmatch {

template stem_map map_stems(const support::scan_file& scan, const mapping_options& options,
                            const Eigen::Vector3d& up, const execution& exec);

}  // namespace globalmatch

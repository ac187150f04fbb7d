// Files of examples/report/ that every report contains; their source is generated when building.
#pragma once

#include <string>

namespace globalmatch::support {

const std::string& report_style();  ///< CSS
const std::string&
report_script();  ///< of the 3-D view; empty where it was not built (GLOBALMATCH_REPORT_3D)

}  // namespace globalmatch::support

#include "support/report/report_file.hpp"

#include <stdexcept>

namespace globalmatch::support {

report_format report_format_of(const std::filesystem::path& path) {
  const std::filesystem::path extension = path.extension();
  if (extension == ".svg") return report_format::svg;
  if (extension == ".html") return report_format::html;
  throw std::invalid_argument("--report " + path.string() +
                              ": a report is a drawing (.svg) or a page (.html); name it so");
}

void require_report_format(const std::filesystem::path& path) {
  if (!path.empty()) report_format_of(path);
}

}  // namespace globalmatch::support

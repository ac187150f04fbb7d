#include "support/e57.hpp"

#include <memory>
#include <string>
#include <utility>

#include "support/e57_description.hpp"
#include "support/e57_pages.hpp"
#include "support/e57_points.hpp"

namespace globalmatch::support {

bool looks_like_e57(std::string_view start) {
  return start.starts_with("ASTM-E57");
}

std::size_t count_e57_scans(input_file& file) {
  const e57_pages pages(file.bytes());
  return e57_description(pages).scans();
}

opened_scan open_e57(input_file& file, std::size_t number, const scan_options& options) {
  const auto pages = std::make_shared<const e57_pages>(file.bytes());
  const e57_description description(*pages);
  const e57_scan scan = description.scan(number);
  opened_scan opened;
  opened.scans = description.scans();
  opened.header.format = "E57 " + pages->version();
  if (opened.scans > 1)
    opened.header.format += ", scan " + std::to_string(number) + " of " + std::to_string(opened.scans);
  opened.header.pose = scan.pose;
  opened.header.attributes = scan.attributes;
  auto points = std::make_unique<e57_points>(pages, scan, options.attributes);
  if (points->has_more()) opened.header.notes.push_back(note_on_more_points(scan.size, "further points"));
  opened.points = std::move(points);
  return opened;
}

void write_e57_with_poses(input_file& file, std::span<const scan_pose> poses, std::ostream& out) {
  const e57_pages pages(file.bytes());
  pages.write_with_xml(out, e57_description(pages).xml_with_poses(poses));
}

}  // namespace globalmatch::support

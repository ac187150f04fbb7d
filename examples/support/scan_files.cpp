#include "support/scan_files.hpp"

#include <string>
#include <string_view>

#include "support/input_file.hpp"
#include "support/scan_formats.hpp"

namespace globalmatch::support {

namespace {

bool looks_like_pcd(std::string_view start) {
  return start.starts_with("# .PCD") || start.starts_with("VERSION ") || start.starts_with("FIELDS ");
}

[[noreturn]] void refuse_e57(const input_file& file) {
  std::filesystem::path converted = file.path();
  converted.replace_extension(".ply");
  file.fail("is an E57 file, which this program does not read",
            "Convert it: pdal translate \"" + file.path().string() + "\" \"" + converted.string() + "\"");
}

}  // namespace

std::vector<Eigen::Vector3d> read_scan(const std::filesystem::path& path) {
  marked_points marked;
  return read_marked_scan(path, marked);
}

std::vector<Eigen::Vector3d> read_marked_scan(const std::filesystem::path& path, marked_points& marked) {
  input_file file(path);
  const std::string_view start = file.peek(4096);
  if (start.empty()) file.fail("is empty", "Copy or export the scan again");
  if (start.starts_with("ply\n") || start.starts_with("ply\r")) return read_ply(file);
  if (start.starts_with("LASF")) return read_las(file, marked);
  if (start.starts_with("ASTM-E57")) refuse_e57(file);
  if (looks_like_pcd(start)) return read_pcd(file);
  if (start.find('\0') != std::string_view::npos)
    file.fail("is in no format that this program knows", "Export the scan as PLY, PCD, LAS or text (x y z)");
  return read_text(file);
}

}  // namespace globalmatch::support

#include "support/scan_files.hpp"

#include <algorithm>
#include <string>
#include <string_view>

#include "support/input_file.hpp"
#include "support/scan_formats.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

// The first line that is no comment, in lower case.
std::string first_line(std::string_view start) {
  while (start.starts_with('#') || start.starts_with('\r') || start.starts_with('\n'))
    start.remove_prefix(std::min(start.find_first_of("\r\n") + 1, start.size()));
  return lower_case(start.substr(0, start.find_first_of("\r\n")));
}

bool looks_like_pcd(std::string_view start) {
  if (start.starts_with("# .PCD")) return true;
  const std::string line = first_line(start);
  return line.starts_with("version ") || line.starts_with("fields ") || line.starts_with("columns ");
}

bool looks_like_ply(std::string_view start) {
  return lower_case(start.substr(0, 3)) == "ply" &&
         trim(start.substr(3, start.find_first_of("\r\n") - 3)).empty() &&
         start.find_first_of("\r\n") != std::string_view::npos;
}

bool looks_like_obj(std::string_view start) {
  const std::string line = first_line(start);
  return line.starts_with("v ") || line.starts_with("mtllib ") || line.starts_with("o ") ||
         line.starts_with("g ");
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
  if (looks_like_ply(start)) return read_ply(file);
  if (start.starts_with("LASF")) return read_las(file, marked);
  if (start.starts_with("ASTM-E57")) refuse_e57(file);
  if (looks_like_pcd(start)) return read_pcd(file);
  if (start.find('\0') != std::string_view::npos)
    file.fail("is in no format that this program knows", "Export the scan as PLY, PCD, LAS or text (x y z)");
  if (looks_like_obj(start))
    file.fail("is an OBJ file, which this program does not read",
              "Export its vertices as PLY or text (x y z)");
  if (looks_like_ptx(start)) return read_ptx(file);
  return read_text(file);
}

}  // namespace globalmatch::support

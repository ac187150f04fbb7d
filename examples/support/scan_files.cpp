#include "support/scan_files.hpp"

#include <algorithm>
#include <memory>
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

point_iterator::value_type point_iterator::operator[](difference_type n) const {
  Eigen::Vector3d p;
  source_->read(i_ + static_cast<std::size_t>(n), {&p, 1});
  return p;
}

void point_iterator::read_block() const {
  constexpr std::size_t block_size = point_source::block_size;
  if (!block_) block_ = std::make_unique_for_overwrite<Eigen::Vector3d[]>(block_size);
  count_ = 0;  // should reading throw
  first_ = i_ - i_ % block_size;
  const std::size_t count = std::min(block_size, source_->size() - first_);
  source_->read(first_, {block_.get(), count});
  count_ = count;
}

scan_file open_scan(const std::filesystem::path& path, const scan_options& options) {
  input_file file(path);
  const std::string_view start = file.peek(4096);
  if (start.empty()) file.fail("is empty", "Copy or export the scan again");
  if (looks_like_ply(start)) return scan_file(open_ply(file));
  if (start.starts_with("LASF")) return scan_file(open_las(file, options));
  if (start.starts_with("ASTM-E57")) refuse_e57(file);
  if (looks_like_pcd(start)) return scan_file(open_pcd(file));
  if (start.find('\0') != std::string_view::npos)
    file.fail("is in no format that this program knows", "Export the scan as PLY, PCD, LAS or text (x y z)");
  if (looks_like_obj(start))
    file.fail("is an OBJ file, which this program does not read",
              "Export its vertices as PLY or text (x y z)");
  if (looks_like_ptx(start)) return scan_file(open_ptx(file));
  return scan_file(open_text(file));
}

}  // namespace globalmatch::support

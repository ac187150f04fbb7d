#include "support/scan_files.hpp"

#include <algorithm>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "support/e57.hpp"
#include "support/input_file.hpp"
#include "support/las.hpp"
#include "support/makers_formats.hpp"
#include "support/pts.hpp"
#include "support/ptx.hpp"
#include "support/scan_formats.hpp"
#include "support/scan_sets.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

constexpr std::size_t start_size = 4096;  // [bytes] that formats are recognised by

// The first line that is no comment, in lower case.
std::string first_line(std::string_view start) {
  while (start.starts_with('#') || start.starts_with('\r') || start.starts_with('\n')) {
    const std::size_t end = start.find_first_of("\r\n");
    start.remove_prefix(end == std::string_view::npos ? start.size() : end + 1);
  }
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

// A format whose files may hold several scans.
struct format_of_several {
  bool (*recognises)(std::string_view start);
  std::size_t (*count)(const std::filesystem::path& path);
  opened_scan (*open)(const std::filesystem::path& path, std::size_t number, const scan_options& options);
};

constexpr format_of_several formats_of_several[] = {{looks_like_e57, count_e57_scans, open_e57},
                                                    {looks_like_ptx, count_ptx_scans, open_ptx}};

const format_of_several* find_format_of_several(std::string_view start) {
  const auto format = std::find_if(std::begin(formats_of_several), std::end(formats_of_several),
                                   [&](const format_of_several& f) { return f.recognises(start); });
  return format == std::end(formats_of_several) ? nullptr : format;
}

opened_scan open_single(input_file& file, std::string_view start, const scan_options& options) {
  if (looks_like_ply(start)) return open_ply(file, options);
  if (start.starts_with("LASF")) return open_las(file, options);
  if (looks_like_pcd(start)) return open_pcd(file, options);
  if (const auto format = recognise_makers_format(start, file.path()))
    file.fail(format->problem, format->remedy);
  if (start.find('\0') != std::string_view::npos)
    file.fail("is in no format that this program knows",
              "Export the scan as PLY, PCD, LAS, LAZ, E57, PTX or text (x y z)");
  const bool is_named_ptx = lower_case(file.path().extension().string()) == ".ptx";
  if (is_named_ptx && to_count(trim(first_line(start))))
    file.fail("has a damaged PTX header", "Export the scan again as PTX, E57, PLY, LAS or text (x y z)");
  if (looks_like_pts(start)) require_announced_blocks(file.path());
  if (looks_like_obj(start))
    file.fail("is an OBJ file, which this program does not read",
              "Export its vertices as PLY or text (x y z)");
  return open_text(file, options);
}

opened_scan open_one_of(const format_of_several& format, const numbered_scan& scan, const input_file& file,
                        const scan_options& options) {
  if (scan.number) return format.open(scan.path, *scan.number, options);
  if (const std::size_t count = format.count(scan.path); count > 1) {
    const std::string name = scan.path.string();
    file.fail("holds " + std::to_string(count) + " scans",
              "Name one of them: \"" + name + "#1\" to \"" + name + '#' + std::to_string(count) + '"');
  }
  return format.open(scan.path, 1, options);
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

numbered_scan parse_scan_name(const std::filesystem::path& name) {
  std::error_code ignored;
  const std::string text = name.string();
  const std::size_t at = text.rfind('#');
  if (at == std::string::npos || std::filesystem::exists(name, ignored)) return {name, {}};
  const auto number = to_count(std::string_view(text).substr(at + 1));
  return number ? numbered_scan{text.substr(0, at), *number} : numbered_scan{name, {}};
}

std::vector<std::filesystem::path> scans_in(const std::filesystem::path& path) {
  if (parse_scan_name(path).number) return {path};
  input_file file(path);
  const format_of_several* format = find_format_of_several(file.peek(start_size));
  const std::size_t count = format ? format->count(path) : 1;
  if (count <= 1) return {path};
  std::vector<std::filesystem::path> names;
  for (std::size_t k = 1; k <= count; ++k) names.push_back(path.string() + '#' + std::to_string(k));
  return names;
}

scan_file open_scan(const std::filesystem::path& path, const scan_options& options) {
  std::error_code ignored;
  if (options.tiles && std::filesystem::is_directory(path, ignored)) return open_tiles(path, options);
  const numbered_scan scan = parse_scan_name(path);
  input_file file(scan.path);
  const std::string_view start = file.peek(start_size);
  if (start.empty()) file.fail("is empty", "Copy or export the scan again");
  const format_of_several* format = find_format_of_several(start);
  if (format) return scan_file(open_one_of(*format, scan, file, options));
  // Blocks of a PTS file are in one frame: they are one scan, unless one of them is asked for.
  if (scan.number && looks_like_pts(start)) return scan_file(open_pts(scan.path, *scan.number, options));
  if (scan.number.value_or(1) != 1)
    file.fail("holds one scan, and no scan " + std::to_string(*scan.number), "Name the file alone");
  return scan_file(open_single(file, start, options));
}

}  // namespace globalmatch::support

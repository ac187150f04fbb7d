#include "support/numbered_scans.hpp"

#include <algorithm>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "support/e57.hpp"
#include "support/file_error.hpp"
#include "support/input_file.hpp"
#include "support/las.hpp"
#include "support/makers_formats.hpp"
#include "support/pts.hpp"
#include "support/ptx.hpp"
#include "support/scan_formats.hpp"
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

// The word that begins that line, where others follow.
std::string first_word(std::string_view start) {
  const std::string line = first_line(start);
  const std::size_t end = line.find_first_of(" \t");
  return end == std::string::npos ? std::string() : line.substr(0, end);
}

bool looks_like_pcd(std::string_view start) {
  if (start.starts_with("# .PCD")) return true;
  const std::string word = first_word(start);
  return word == "version" || word == "fields" || word == "columns";
}

bool looks_like_ply(std::string_view start) {
  return lower_case(start.substr(0, 3)) == "ply" &&
         trim(start.substr(3, start.find_first_of("\r\n") - 3)).empty() &&
         start.find_first_of("\r\n") != std::string_view::npos;
}

// OFF begins with that word, after letters for what vertices have besides: ST, C, N, 4, n.
bool looks_like_off(std::string_view start) {
  std::string word = first_line(start);
  word.resize(std::min(word.size(), word.find_first_of(" \t")));
  return word.ends_with("off") && word.find_first_not_of("stcn4") == word.size() - 3;
}

bool looks_like_obj(std::string_view start) {
  const std::string word = first_word(start);
  return word == "v" || word == "mtllib" || word == "o" || word == "g";
}

// A format whose files may hold several scans.
struct format_of_several {
  bool (*recognises)(std::string_view start);
  std::size_t (*count)(input_file& file);
  opened_scan (*open)(input_file& file, std::size_t number, const scan_options& options);
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
  if (const bool is_off = looks_like_off(start); is_off || looks_like_obj(start))
    file.fail(std::string("is an ") + (is_off ? "OFF" : "OBJ") + " file, which this program does not read",
              "Export its vertices as PLY or text (x y z)");
  return open_text(file, options);
}

// Where no scan is named, the first is read: only then is it known whether there are others.
opened_scan open_one_of(const format_of_several& format, const numbered_scan& scan, input_file& file,
                        const scan_options& options) {
  opened_scan opened = format.open(file, scan.number.value_or(1), options);
  if (scan.number || opened.scans == 1) return opened;
  const std::string name = scan.path.string(), count = std::to_string(opened.scans);
  file.fail("holds " + count + " scans",
            "Name one of them: \"" + name + "#1\" to \"" + name + '#' + count + '"');
}

}  // namespace

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
  const std::size_t count = format ? format->count(file) : 1;
  if (count <= 1) return {path};
  std::vector<std::filesystem::path> names;
  for (std::size_t k = 1; k <= count; ++k) names.push_back(path.string() + '#' + std::to_string(k));
  return names;
}

opened_scan open_numbered_scan(const std::filesystem::path& name, const scan_options& options) {
  const numbered_scan scan = parse_scan_name(name);
  std::error_code ignored;
  const auto makers = recognise_makers_name(scan.path);
  if (makers && std::filesystem::is_directory(scan.path, ignored))
    throw file_error(scan.path, makers->problem, makers->remedy);
  input_file file(scan.path);
  const std::string_view start = file.peek(start_size);
  if (start.empty()) file.fail("is empty", "Copy or export the scan again");
  const format_of_several* format = find_format_of_several(start);
  if (format) return open_one_of(*format, scan, file, options);
  // Blocks of a PTS file are in one frame: they are one scan, unless one of them is asked for.
  if (scan.number && looks_like_pts(start)) return open_pts(file, *scan.number, options);
  if (scan.number.value_or(1) != 1)
    file.fail("holds one scan, and no scan " + std::to_string(*scan.number), "Name the file alone");
  return open_single(file, start, options);
}

}  // namespace globalmatch::support

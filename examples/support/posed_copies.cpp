#include "support/posed_copies.hpp"

#include <array>
#include <string>
#include <string_view>

#include "support/atomic_file.hpp"
#include "support/e57.hpp"
#include "support/file_error.hpp"
#include "support/input_file.hpp"
#include "support/numbered_scans.hpp"
#include "support/ptx.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

enum class posed_format { none, e57, ptx };

posed_format posed_format_of(input_file& file) {
  constexpr std::size_t looked_at = 4096;  // bytes
  const std::string_view start = file.peek(looked_at);
  if (looks_like_e57(start)) return posed_format::e57;
  return looks_like_ptx(start) ? posed_format::ptx : posed_format::none;
}

}  // namespace

bool is_posed_copy(const std::filesystem::path& copy) {
  const std::string ending = lower_case(copy.extension().string());
  return ending == ".e57" || ending == ".ptx";
}

bool is_posed_file(const std::filesystem::path& file) {
  input_file opened(file);
  return posed_format_of(opened) != posed_format::none;
}

void require_rewritable(const std::filesystem::path& copy, const std::filesystem::path& file) {
  input_file opened(file);
  std::array<char, 2> first;
  opened.bytes().read(0, first);
  const std::string_view mark(first.data(), first.size());
  if (mark == "\xff\xfe" || mark == "\xfe\xff")
    throw file_error(copy, "is a copy of " + file.string() + " with its pose, and that is text in UTF-16",
                     "Save " + file.string() + " as UTF-8 or plain text");
}

void require_posed_copy(const std::filesystem::path& copy, const std::filesystem::path& source) {
  input_file file(parse_scan_name(source).path);
  const posed_format format = posed_format_of(file);
  const bool is_e57 = lower_case(copy.extension().string()) == ".e57";
  if (format != (is_e57 ? posed_format::e57 : posed_format::ptx))
    throw file_error(copy,
                     std::string("is a copy of the source with its pose, and that is no ") +
                         (is_e57 ? "E57" : "PTX") + " file",
                     "Choose another form of the transform, or --write");
  require_rewritable(copy, file.path());
}

void write_posed_copy(const std::filesystem::path& copy, const std::filesystem::path& file,
                      std::span<const scan_pose> poses) {
  input_file source(file);
  atomic_file out(copy);
  const auto write =
      posed_format_of(source) == posed_format::e57 ? write_e57_with_poses : write_ptx_with_poses;
  write(source, poses, out.stream());
  out.commit();
}

void write_posed_copy(const std::filesystem::path& copy, const std::filesystem::path& source,
                      const Eigen::Isometry3d& survey_from_file) {
  const numbered_scan scan = parse_scan_name(source);
  const scan_pose pose{scan.number.value_or(1), survey_from_file};
  write_posed_copy(copy, scan.path, {&pose, 1});
}

}  // namespace globalmatch::support

#include "support/scan_sets.hpp"

#include <algorithm>
#include <array>
#include <iostream>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "support/class_counts.hpp"
#include "support/file_error.hpp"
#include "support/makers_formats.hpp"
#include "support/numbered_scans.hpp"
#include "support/text_fields.hpp"
#include "support/wildcards.hpp"

namespace globalmatch::support {

namespace {

bool is_same_pose(const std::optional<Eigen::Isometry3d>& a, const std::optional<Eigen::Isometry3d>& b) {
  constexpr double rounding = 1e-6;
  return a && b ? (a->matrix() - b->matrix()).cwiseAbs().maxCoeff() < rounding : !a && !b;
}

bool has_extension_of_scan(const std::filesystem::path& path) {
  constexpr std::array<std::string_view, 8> extensions = {".ply", ".pcd", ".las", ".laz",
                                                          ".e57", ".ptx", ".pts", ".xyz"};
  return std::find(extensions.begin(), extensions.end(), lower_case(path.extension().string())) !=
         extensions.end();
}

// Sorted; none where the folder has none.
std::vector<std::filesystem::path> scan_files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::error_code ignored;  // a link that leads nowhere is no scan
    const bool is_hidden = at->path().filename().string().starts_with('.');
    if (at->is_regular_file(ignored) && !is_hidden && has_extension_of_scan(at->path()))
      files.push_back(at->path());
  }
  if (error) throw file_error(folder, "cannot be listed (" + error.message() + ")", "Check its permissions");
  std::sort(files.begin(), files.end());
  return files;
}

// What is in a folder in formats that only makers' programs read, which may be folders.
std::vector<std::filesystem::path> makers_files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    if (recognise_makers_name(at->path())) files.push_back(at->path());
  std::sort(files.begin(), files.end());
  return files;
}

// What is passed over in a folder that has scans; nothing where there is none.
std::optional<std::string> note_on_makers_files(const std::filesystem::path& folder) {
  const std::vector<std::filesystem::path> files = makers_files_in(folder);
  if (files.empty()) return std::nullopt;
  const auto makers = recognise_makers_name(files.front());
  return std::to_string(files.size()) +
         " files of makers are passed over: " + files.front().filename().string() + ' ' + makers->problem +
         ". " + makers->remedy;
}

std::vector<std::filesystem::path> require_scan_files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files = scan_files_in(folder);
  if (!files.empty()) return files;
  std::vector<std::filesystem::path> others = makers_files_in(folder);
  others.push_back(folder);  // which may be a maker's itself
  if (const auto makers = recognise_makers_name(others.front()))
    throw file_error(others.front(), makers->problem, makers->remedy);
  throw file_error(folder, "holds no scans",
                   "Those have the extensions .ply .pcd .las .laz .e57 .ptx .pts .xyz; name others by file");
}

std::vector<std::filesystem::path> scans_in_folder(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> scans;
  for (const auto& file : require_scan_files_in(folder))
    for (auto& scan : scans_in(file)) scans.push_back(std::move(scan));
  return scans;
}

// Attributes need the longest records, and coordinates the finest steps.
void join(std::optional<las_frame>& all, const std::optional<las_frame>& part) {
  if (!all || !part) {
    all.reset();
    return;
  }
  all->scale = all->scale.cwiseAbs().cwiseMin(part->scale.cwiseAbs());
  all->format = std::max(all->format, part->format);
}

// Points of several scans, one scan after the other. Each begins at a multiple of the block size, so that its
// blocks are read whole; the places between are not-a-number.
class joined_points final : public point_source {
 public:
  explicit joined_points(std::vector<std::unique_ptr<point_source>> parts) : parts_(std::move(parts)) {
    for (const auto& part : parts_)
      first_.push_back(first_.back() + (part->size() + block_size - 1) / block_size * block_size);
  }

  std::size_t size() const override { return first_.back(); }

  void read(std::size_t first, std::span<Eigen::Vector3d> points) const override {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    std::fill(points.begin(), points.end(), Eigen::Vector3d(none, none, none));
    const std::size_t end = first + points.size();
    const auto after = std::upper_bound(first_.begin(), first_.end(), first);
    for (auto part = std::size_t(after - first_.begin() - 1); part < parts_.size() && first_[part] < end;
         ++part) {
      const std::size_t begin = std::max(first, first_[part]);
      const std::size_t part_end = std::min(end, first_[part] + parts_[part]->size());
      if (begin < part_end)
        parts_[part]->read(begin - first_[part], points.subspan(begin - first, part_end - begin));
    }
  }

  // Those that all parts have.
  std::vector<attribute> attributes() const override {
    std::vector<attribute> common = parts_.front()->attributes();
    for (const auto& part : parts_)
      std::erase_if(common, [of_part = part->attributes()](const attribute& a) {
        return std::find(of_part.begin(), of_part.end(), a) == of_part.end();
      });
    return common;
  }

  void read_attributes(std::size_t first, std::size_t count,
                       std::span<attribute_column> columns) const override {
    const std::vector<attribute> all = attributes();
    for (attribute_column& column : columns)
      column.numbers.assign(count * size_of(all[column.attribute].type), '\0');
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      const std::size_t begin = std::max(first, first_[part]);
      const std::size_t end = std::min(first + count, first_[part] + parts_[part]->size());
      if (begin < end) read_part(part, begin - first_[part], end - begin, begin - first, all, columns);
    }
  }

  marked_points marked() const override {
    marked_points all;
    for (const auto& part : parts_) {
      all.noise += part->marked().noise;
      all.withheld += part->marked().withheld;
    }
    return all;
  }

  std::optional<class_counts> count_classes(const execution& exec) const override {
    std::optional<class_counts> sum;
    for (const auto& part : parts_)
      if (const auto counts = part->count_classes(exec)) sum = sum.value_or(class_counts{}) += *counts;
    return sum;
  }

 private:
  // Reads into the columns from number `at` on.
  void read_part(std::size_t part, std::size_t first, std::size_t count, std::size_t at,
                 const std::vector<attribute>& all, std::span<attribute_column> columns) const {
    const point_source& points = *parts_[part];
    const std::vector<attribute> of_part = points.attributes();
    std::vector<attribute_column> read(columns.size());
    for (std::size_t k = 0; k < read.size(); ++k)
      read[k].attribute = static_cast<std::size_t>(
          std::find(of_part.begin(), of_part.end(), all[columns[k].attribute]) - of_part.begin());
    points.read_attributes(first, count, read);
    for (std::size_t k = 0; k < read.size(); ++k) {
      const std::size_t size = size_of(all[columns[k].attribute].type);
      std::copy(read[k].numbers.begin(), read[k].numbers.end(),
                columns[k].numbers.begin() + static_cast<std::ptrdiff_t>(at * size));
    }
  }

  std::vector<std::unique_ptr<point_source>> parts_;
  std::vector<std::size_t> first_ = {0};  // where each part begins, and the end
};

}  // namespace

std::vector<std::filesystem::path> find_scans(const std::vector<std::filesystem::path>& names,
                                              bool keep_folders) {
  std::vector<std::filesystem::path> scans;
  for (const auto& name : expand_patterns(names)) {
    std::error_code ignored;
    const bool is_folder = std::filesystem::is_directory(name, ignored);
    if (is_folder && keep_folders) {
      scans.push_back(name);
      continue;
    }
    if (const auto note = is_folder && holds_scans(name) ? note_on_makers_files(name) : std::nullopt)
      std::cerr << name.string() << ": " << *note << '\n';
    for (auto& scan : is_folder ? scans_in_folder(name) : scans_in(name)) scans.push_back(std::move(scan));
  }
  return scans;
}

bool holds_scans(const std::filesystem::path& folder) {
  return !scan_files_in(folder).empty();
}

std::string name_of(const std::filesystem::path& scan) {
  std::error_code ignored;
  const std::filesystem::path whole = scan.has_filename() ? scan : scan.parent_path();  // folder/
  if (std::filesystem::is_directory(whole, ignored)) return whole.filename().string();
  const auto [file, number] = parse_scan_name(whole);
  if (file == "-") return "standard_input" + (number ? '_' + std::to_string(*number) : "");
  return file.stem().string() + (number ? '_' + std::to_string(*number) : "");
}

opened_scan open_tiles(const std::filesystem::path& folder, const scan_options& options) {
  std::vector<std::unique_ptr<point_source>> parts;
  std::optional<scan_header> header;
  std::vector<std::string> notes;
  if (auto note = note_on_makers_files(folder)) notes.push_back(*std::move(note));
  for (const auto& name : scans_in_folder(folder)) {
    opened_scan part = open_numbered_scan(name, options);
    if (!header) header = part.header;
    if (!is_same_pose(part.header.pose, header->pose))
      throw file_error(folder, "holds scans whose headers have poses of their own: they are not in one frame",
                       "Leave out --tiles, or export the tiles in one frame");
    if (part.header.format != header->format) header->format = "several formats";
    for (const std::string& note : part.header.notes) notes.push_back(name.filename().string() + ": " + note);
    join(header->las, part.header.las);
    parts.push_back(std::move(part.points));
  }
  header->format += ", " + std::to_string(parts.size()) + " tiles";
  header->notes = std::move(notes);
  return {std::make_unique<joined_points>(std::move(parts)), *std::move(header)};
}

}  // namespace globalmatch::support

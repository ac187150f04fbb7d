#include "support/scan_sets.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "support/file_error.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

bool has_extension_of_scan(const std::filesystem::path& path) {
  constexpr std::array<std::string_view, 8> extensions = {".ply", ".pcd", ".las", ".laz",
                                                          ".e57", ".ptx", ".pts", ".xyz"};
  return std::find(extensions.begin(), extensions.end(), lower_case(path.extension().string())) !=
         extensions.end();
}

std::vector<std::filesystem::path> scan_files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.is_regular_file() && has_extension_of_scan(entry.path())) files.push_back(entry.path());
  if (files.empty())
    throw file_error(
        folder, "holds no scans",
        "Those have the extensions .ply .pcd .las .laz .e57 .ptx .pts .xyz; name others by file");
  std::sort(files.begin(), files.end());
  return files;
}

// Points of several scans, one scan after the other. Each begins at a multiple of the block size, so that its
// blocks are read whole; the places between are not-a-number.
class joined_points final : public point_source {
 public:
  explicit joined_points(std::vector<scan_file> parts) : parts_(std::move(parts)) {
    for (const scan_file& part : parts_)
      first_.push_back(first_.back() + (part.size() + block_size - 1) / block_size * block_size);
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
      const std::size_t part_end = std::min(end, first_[part] + parts_[part].size());
      if (begin < part_end)
        parts_[part].points().read(begin - first_[part], points.subspan(begin - first, part_end - begin));
    }
  }

  marked_points marked() const override {
    marked_points all;
    for (const scan_file& part : parts_) {
      all.noise += part.marked().noise;
      all.withheld += part.marked().withheld;
    }
    return all;
  }

 private:
  std::vector<scan_file> parts_;
  std::vector<std::size_t> first_ = {0};  // where each part begins, and the end
};

}  // namespace

std::vector<std::filesystem::path> find_scans(const std::vector<std::filesystem::path>& names) {
  std::vector<std::filesystem::path> scans;
  for (const auto& name : names) {
    const bool is_folder = std::filesystem::is_directory(name);
    for (const auto& file : is_folder ? scan_files_in(name) : std::vector{name})
      for (auto& scan : scans_in(file)) scans.push_back(std::move(scan));
  }
  return scans;
}

std::string name_of(const std::filesystem::path& scan) {
  const std::string extension = scan.extension().string();
  const std::size_t number = extension.find('#');
  return scan.stem().string() + (number == std::string::npos ? "" : '_' + extension.substr(number + 1));
}

scan_file open_tiles(const std::filesystem::path& folder, const scan_options& options) {
  std::vector<scan_file> parts;
  for (const auto& name : find_scans({folder})) parts.push_back(open_scan(name, options));
  scan_header header = parts.front().header();
  header.format += ", " + std::to_string(parts.size()) + " tiles";
  header.pose.reset();
  return scan_file({std::make_unique<joined_points>(std::move(parts)), std::move(header)});
}

}  // namespace globalmatch::support

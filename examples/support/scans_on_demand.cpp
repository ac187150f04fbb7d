#include "support/scans_on_demand.hpp"

#include <utility>

#include "support/file_error.hpp"

namespace globalmatch::support {

namespace {

class points_on_demand final : public point_source {
 public:
  points_on_demand(std::filesystem::path path, std::shared_ptr<scan_opener> opener, const scan_file& scan)
      : path_(std::move(path)),
        opener_(std::move(opener)),
        size_(scan.size()),
        attributes_(scan.points().attributes()) {}

  std::size_t size() const override { return size_; }
  void read(std::size_t first, std::span<Eigen::Vector3d> points) const override {
    opened()->points().read(first, points);
  }
  std::vector<attribute> attributes() const override { return attributes_; }
  void read_attributes(std::size_t first, std::size_t count,
                       std::span<attribute_column> columns) const override {
    opened()->points().read_attributes(first, count, columns);
  }

 private:
  std::shared_ptr<const scan_file> opened() const {
    auto scan = opener_->open(path_);
    if (scan->size() != size_)
      throw file_error(path_, "has changed while it was read", "Run again when nothing writes to it");
    return scan;
  }

  std::filesystem::path path_;
  std::shared_ptr<scan_opener> opener_;
  std::size_t size_;
  std::vector<attribute> attributes_;
};

}  // namespace

std::shared_ptr<const scan_file> scan_opener::open(const std::filesystem::path& path) {
  const std::lock_guard lock(mutex_);
  if (!scan_ || path_ != path) {
    scan_.reset();
    scan_ = std::make_shared<const scan_file>(open_scan(path, options_));
    path_ = path;
  }
  return scan_;
}

scan_file open_on_demand(const std::filesystem::path& path, const std::shared_ptr<scan_opener>& opener) {
  const auto scan = opener->open(path);
  return scan_file({std::make_unique<points_on_demand>(path, opener, *scan), scan->header()});
}

}  // namespace globalmatch::support

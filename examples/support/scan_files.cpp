#include "support/scan_files.hpp"

#include <algorithm>
#include <memory>
#include <system_error>

#include "support/scan_sets.hpp"

namespace globalmatch::support {

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
  std::error_code ignored;
  const bool is_tiles = options.tiles && std::filesystem::is_directory(path, ignored);
  return scan_file(is_tiles ? open_tiles(path, options) : open_numbered_scan(path, options));
}

}  // namespace globalmatch::support

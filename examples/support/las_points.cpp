#include "support/las_points.hpp"

#include <algorithm>
#include <limits>

namespace globalmatch::support {

point_scaling::point_scaling(const Eigen::Vector3d& scale, const Eigen::Vector3d& offset, bool keep_marked,
                             std::size_t size)
    : scale_(scale),
      offset_(offset),
      keep_marked_(keep_marked),
      size_(size),
      is_counted_(std::make_unique<std::atomic<bool>[]>((size + point_source::block_size - 1) /
                                                        point_source::block_size)) {}

void point_scaling::scale(std::size_t first, std::span<const raw_point> raw,
                          std::span<const point_mark> marks, std::span<Eigen::Vector3d> points) {
  count(first, marks);
  for (std::size_t i = 0; i < raw.size(); ++i) {
    const Eigen::Vector3d p(raw[i].x, raw[i].y, raw[i].z);
    points[i] = p.cwiseProduct(scale_) + offset_;
  }
  if (keep_marked_) return;
  for (std::size_t i = 0; i < raw.size(); ++i)
    if (marks[i] != point_mark::none) points[i].setConstant(std::numeric_limits<double>::quiet_NaN());
}

void point_scaling::count(std::size_t first, std::span<const point_mark> marks) {
  constexpr std::size_t block_size = point_source::block_size;
  for (std::size_t block = (first + block_size - 1) / block_size; block * block_size < size_; ++block) {
    const std::size_t begin = block * block_size;
    const std::size_t size = std::min(block_size, size_ - begin);
    if (begin + size > first + marks.size()) return;
    if (is_counted_[block].exchange(true)) continue;
    const auto of_block = marks.subspan(begin - first, size);
    const auto times = [&](point_mark mark) {
      return static_cast<std::size_t>(std::count(of_block.begin(), of_block.end(), mark));
    };
    noise_ += times(point_mark::noise);
    withheld_ += times(point_mark::withheld);
  }
}

}  // namespace globalmatch::support

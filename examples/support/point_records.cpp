#include "support/point_records.hpp"

#include <memory>
#include <utility>

namespace globalmatch::support {

namespace {

template <class T>
void decode_as(const char* at, std::size_t stride, std::endian order, Eigen::Index axis,
               std::span<Eigen::Vector3d> points) {
  if (order == std::endian::native)
    for (Eigen::Vector3d& p : points)
      p[axis] = static_cast<double>(load<T>(std::exchange(at, at + stride), std::endian::native));
  else
    for (Eigen::Vector3d& p : points)
      p[axis] = static_cast<double>(load<T>(std::exchange(at, at + stride), order));
}

// One coordinate of all points. Its type is looked at once, not for each point.
void decode(scalar type, const char* first, std::size_t stride, std::endian order, Eigen::Index axis,
            std::span<Eigen::Vector3d> points) {
  visit_type(type, [&]<class T>(T) { decode_as<T>(first, stride, order, axis, points); });
}

}  // namespace

point_records::point_records(file_bytes file, const record_layout& layout)
    : file_(std::move(file)), layout_(layout) {
  if (layout.begin > file_.size() ||
      (layout.size > 0 && layout.count > (file_.size() - layout.begin) / layout.size))
    file_.fail_truncated();
}

void point_records::read(std::size_t first, std::span<Eigen::Vector3d> points) const {
  const std::size_t bytes = points.size() * layout_.size;
  const auto records = std::make_unique_for_overwrite<char[]>(bytes);
  file_.read(layout_.begin + std::uint64_t(first) * layout_.size, {records.get(), bytes});
  for (std::size_t axis = 0; axis < 3; ++axis)
    decode(layout_.types[axis], records.get() + layout_.offsets[axis], layout_.size, layout_.order,
           static_cast<Eigen::Index>(axis), points);
}

}  // namespace globalmatch::support

#include "support/point_records.hpp"

#include <memory>
#include <utility>

#include "support/class_counts.hpp"

namespace globalmatch::support {

namespace {

// Coordinates of one type, as most files have them.
template <class T, std::endian Order>
void decode_as(const char* record, const record_layout& layout, std::span<Eigen::Vector3d> points) {
  const std::array<std::size_t, 3> at = layout.offsets;
  for (Eigen::Vector3d& p : points) {
    p = {static_cast<double>(load<T>(record + at[0], Order)),
         static_cast<double>(load<T>(record + at[1], Order)),
         static_cast<double>(load<T>(record + at[2], Order))};
    record += layout.size;
  }
}

void decode_each(const char* record, const record_layout& layout, std::span<Eigen::Vector3d> points) {
  for (Eigen::Vector3d& p : points) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      p[static_cast<Eigen::Index>(axis)] =
          load(layout.types[axis], record + layout.offsets[axis], layout.order);
    record += layout.size;
  }
}

// Values that are no such number are not counted.
template <std::size_t Size>
void count_field(const char* records, std::size_t count, const record_layout& layout,
                 const std::optional<record_field>& field, std::array<std::size_t, Size>& counts) {
  if (!field) return;
  for (std::size_t i = 0; i < count; ++i) {
    const double value = load(field->type, records + i * layout.size + field->offset, layout.order);
    if (value >= 0 && value < double(Size)) ++counts[static_cast<std::size_t>(value)];
  }
}

}  // namespace

point_records::point_records(file_bytes file, const record_layout& layout)
    : file_(std::move(file)), layout_(layout) {
  if (layout.begin > file_.size() ||
      (layout.size > 0 && layout.count > (file_.size() - layout.begin) / layout.size))
    file_.fail_truncated();
}

std::unique_ptr<char[]> point_records::read_records(std::size_t first, std::size_t count) const {
  const std::size_t bytes = count * layout_.size;
  auto records = std::make_unique_for_overwrite<char[]>(bytes);
  file_.read(layout_.begin + std::uint64_t(first) * layout_.size, {records.get(), bytes});
  return records;
}

void point_records::read(std::size_t first, std::span<Eigen::Vector3d> points) const {
  const auto records = read_records(first, points.size());
  if (layout_.types[1] == layout_.types[0] && layout_.types[2] == layout_.types[0])
    visit_type(layout_.types[0], [&]<class T>(T) {
      layout_.order == std::endian::little ? decode_as<T, std::endian::little>(records.get(), layout_, points)
                                           : decode_as<T, std::endian::big>(records.get(), layout_, points);
    });
  else
    decode_each(records.get(), layout_, points);
}

std::optional<class_counts> point_records::count_classes(const execution& exec) const {
  if (!layout_.return_number && !layout_.return_count && !layout_.class_number) return std::nullopt;
  return count_in_chunks(
      exec, size(), block_size, [&](std::size_t begin, std::size_t end, class_counts& counts) {
        const auto records = read_records(begin, end - begin);
        count_field(records.get(), end - begin, layout_, layout_.return_number, counts.return_numbers);
        count_field(records.get(), end - begin, layout_, layout_.return_count, counts.return_counts);
        count_field(records.get(), end - begin, layout_, layout_.class_number, counts.classes);
      });
}

}  // namespace globalmatch::support

#include "support/point_records.hpp"

#include <algorithm>
#include <memory>
#include <string_view>
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

const record_field* find_field(std::span<const record_field> fields, std::string_view name) {
  const auto field = std::find_if(fields.begin(), fields.end(),
                                  [&](const record_field& f) { return common_name(f.what.name) == name; });
  return field == fields.end() ? nullptr : &*field;
}

// Values that are no such number are not counted.
template <std::size_t Size>
void count_field(const record_array& records, const record_field* field,
                 std::array<std::size_t, Size>& counts) {
  if (!field) return;
  for (std::size_t i = 0; i < records.count; ++i) {
    const char* record = records.bytes + i * records.record_size;
    const double value = load(field->what.type, record + field->offset, records.order);
    if (value >= 0 && value < double(Size)) ++counts[static_cast<std::size_t>(value)];
  }
}

}  // namespace

point_records::point_records(file_bytes file, record_layout layout)
    : file_(std::move(file)), layout_(std::move(layout)) {
  if (layout_.begin > file_.size() ||
      (layout_.size > 0 && layout_.count > (file_.size() - layout_.begin) / layout_.size))
    file_.fail_truncated();
}

std::unique_ptr<char[]> point_records::read_records(std::size_t first, std::size_t count) const {
  const std::size_t bytes = count * layout_.size;
  auto records = std::make_unique_for_overwrite<char[]>(bytes);
  file_.read(layout_.begin + std::uint64_t(first) * layout_.size, {records.get(), bytes});
  return records;
}

void point_records::read_attributes(std::size_t first, std::size_t count,
                                    std::span<attribute_column> columns) const {
  const auto records = read_records(first, count);
  gather({records.get(), layout_.size, count, layout_.order}, layout_.fields, columns);
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
  const record_field* const return_number = find_field(layout_.fields, "return_number");
  const record_field* const return_count = find_field(layout_.fields, "number_of_returns");
  const record_field* const class_number = find_field(layout_.fields, "classification");
  if (!return_number && !return_count && !class_number) return std::nullopt;
  return count_in_chunks(exec, size(), block_size,
                         [&](std::size_t begin, std::size_t end, class_counts& counts) {
                           const auto bytes = read_records(begin, end - begin);
                           const record_array records{bytes.get(), layout_.size, end - begin, layout_.order};
                           count_field(records, return_number, counts.return_numbers);
                           count_field(records, return_count, counts.return_counts);
                           count_field(records, class_number, counts.classes);
                         });
}

}  // namespace globalmatch::support

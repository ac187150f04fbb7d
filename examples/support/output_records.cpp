#include "support/output_records.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "globalmatch/detail/core/threads.hpp"

namespace globalmatch::support {

namespace {

constexpr std::size_t max_block = 16 * point_source::block_size;  // [points]
constexpr std::size_t max_block_bytes = std::size_t(8) << 20;

template <class T>
void store(char* at, T value) {
  std::memcpy(at, &value, sizeof(T));
  if constexpr (std::endian::native != std::endian::little) std::reverse(at, at + sizeof(T));
}

/// Makes records of some points. What it allocates is kept for the next.
class record_maker {
 public:
  void make(const placed_scan& scan, const scan_records& layout, const output_records& all, std::size_t first,
            std::size_t count);
  std::span<const char> records() const { return records_; }

 private:
  void put_coordinates(const placed_scan& scan, const output_records& all);

  std::vector<Eigen::Vector3d> points_;
  std::vector<std::size_t> kept_;
  std::vector<attribute_column> columns_;
  std::vector<char> records_;
};

void record_maker::make(const placed_scan& scan, const scan_records& layout, const output_records& all,
                        std::size_t first, std::size_t count) {
  points_.resize(count);
  scan.scan->points().read(first, points_);
  kept_.clear();
  for (std::size_t i = 0; i < count; ++i)
    if (points_[i].allFinite()) kept_.push_back(i);
  records_.resize(kept_.size() * all.record_size);
  for (std::size_t i = 0; i < kept_.size(); ++i)
    layout.prototype.copy(records_.data() + i * all.record_size, all.record_size);
  put_coordinates(scan, all);
  columns_.resize(layout.fields.size());
  for (std::size_t k = 0; k < columns_.size(); ++k) columns_[k].attribute = layout.fields[k].index;
  if (!columns_.empty()) scan.scan->points().read_attributes(first, count, columns_);
  for (std::size_t k = 0; k < columns_.size(); ++k)
    put_numbers(columns_[k].numbers, layout.fields[k].from, kept_, layout.fields[k].to, all.record_size,
                records_.data());
}

void record_maker::put_coordinates(const placed_scan& scan, const output_records& all) {
  char* record = records_.data();
  for (const std::size_t i : kept_) {
    Eigen::Vector3d p = scan.target_from_scan * points_[i];
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      if (all.grid)
        store(record + 4 * axis, static_cast<std::int32_t>(std::llround((p[axis] - all.grid->offset[axis]) /
                                                                        all.grid->scale[axis])));
      else
        store(record + 8 * axis, p[axis]);
    record += all.record_size;
  }
}

}  // namespace

void put_missing(std::span<const record_field> fields, scan_records& scan) {
  for (const record_field& field : fields) {
    const bool has_it = std::any_of(scan.fields.begin(), scan.fields.end(),
                                    [&](const mapped_field& f) { return f.to.offset == field.offset; });
    char* at = scan.prototype.data() + field.offset;
    if (!has_it && field.what.type == scalar::float32) store(at, std::numeric_limits<float>::quiet_NaN());
    if (!has_it && field.what.type == scalar::float64) store(at, std::numeric_limits<double>::quiet_NaN());
  }
}

points_extent extent_of(const placed_scan& scan, int threads) {
  const std::size_t size = scan.scan->size();
  std::vector<points_extent> extents((size + max_block - 1) / max_block);
  detail::parallel_for(
      execution{.threads = threads}, "read points", extents.size(),
      [&](std::size_t i) {
        const std::size_t first = i * max_block;
        std::vector<Eigen::Vector3d> points(std::min(max_block, size - first));
        scan.scan->points().read(first, points);
        for (const Eigen::Vector3d& p : points) {
          if (!p.allFinite()) continue;
          const Eigen::Vector3d transformed = scan.target_from_scan * p;
          ++extents[i].count;
          extents[i].min = extents[i].min.cwiseMin(transformed);
          extents[i].max = extents[i].max.cwiseMax(transformed);
        }
      },
      1);
  points_extent all;
  for (const points_extent& extent : extents) {
    all.count += extent.count;
    all.min = all.min.cwiseMin(extent.min);
    all.max = all.max.cwiseMax(extent.max);
  }
  return all;
}

void for_each_record(std::span<const placed_scan> scans, const output_records& layout, int threads,
                     const std::function<void(std::span<const char>)>& use) {
  const execution exec{.threads = threads};
  std::vector<record_maker> makers(2 * static_cast<std::size_t>(detail::thread_count(exec)));
  for (std::size_t s = 0; s < scans.size(); ++s) {
    const std::size_t size = scans[s].scan->size();
    const std::size_t block = std::clamp<std::size_t>(max_block_bytes / layout.record_size, 1, max_block);
    for (std::size_t begin = 0; begin < size; begin += makers.size() * block) {
      const std::size_t blocks = std::min(makers.size(), (size - begin + block - 1) / block);
      detail::parallel_for(
          exec, "make records", blocks,
          [&](std::size_t i) {
            const std::size_t first = begin + i * block;
            makers[i].make(scans[s], layout.scans[s], layout, first, std::min(block, size - first));
          },
          1);
      for (std::size_t i = 0; i < blocks; ++i) use(makers[i].records());
    }
  }
}

}  // namespace globalmatch::support

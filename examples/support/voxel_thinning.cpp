#include "support/voxel_thinning.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include "globalmatch/detail/core/threads.hpp"

namespace globalmatch::support {

namespace {

constexpr int axis_bits = 21;
constexpr std::int64_t max_cell = std::int64_t(1) << axis_bits;
constexpr std::uint64_t no_voxel = std::numeric_limits<std::uint64_t>::max();

/// Voxels from `min` to below `max` in plan, at any height.
struct plan_box {
  std::array<std::int64_t, 2> min = {max_cell, max_cell}, max = {0, 0};

  void include(std::int64_t x, std::int64_t y) {
    min = {std::min(min[0], x), std::min(min[1], y)};
    max = {std::max(max[0], x + 1), std::max(max[1], y + 1)};
  }
  bool holds(std::int64_t x, std::int64_t y) const {
    return x >= min[0] && x < max[0] && y >= min[1] && y < max[1];
  }
  bool meets(const plan_box& other) const {
    return min[0] < other.max[0] && other.min[0] < max[0] && min[1] < other.max[1] && other.min[1] < max[1];
  }
};

/// Numbers below `no_voxel`, up to a maximum of them.
class number_set {
 public:
  explicit number_set(std::size_t maximum) : maximum_(maximum), slots_(1024, no_voxel) {}

  bool is_full() const { return size_ >= maximum_; }

  /// Whether it is new.
  bool insert(std::uint64_t number) {
    if (2 * size_ >= slots_.size()) grow();
    std::uint64_t& slot = slot_of(number);
    if (slot == number) return false;
    slot = number;
    ++size_;
    return true;
  }

 private:
  std::uint64_t& slot_of(std::uint64_t number) {
    constexpr std::uint64_t multiplier = 0x9e3779b97f4a7c15u;  // 2^64 / golden ratio (Knuth)
    const std::size_t mask = slots_.size() - 1;
    std::size_t i = ((number * multiplier) >> 32) & mask;
    while (slots_[i] != no_voxel && slots_[i] != number) i = (i + 1) & mask;
    return slots_[i];
  }
  void grow() {
    std::vector<std::uint64_t> old(2 * slots_.size(), no_voxel);
    old.swap(slots_);
    for (const std::uint64_t number : old)
      if (number != no_voxel) slot_of(number) = number;
  }

  std::size_t maximum_, size_ = 0;
  std::vector<std::uint64_t> slots_;
};

class thinning {
 public:
  thinning(std::span<const placed_scan> scans, double voxel, int threads, std::size_t max_voxels)
      : scans_(scans), voxel_(voxel), threads_(threads), max_voxels_(max_voxels), boxes_(scans.size()) {
    if (scans.empty()) return;
    const Eigen::Vector3d middle = scans.front().target_from_scan.translation();
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      first_[axis] = std::floor(middle[axis] / voxel) - double(max_cell / 2);
  }

  std::vector<std::vector<bool>> run() {
    for (const placed_scan& scan : scans_) kept_.emplace_back(scan.scan->size(), false);
    plan_box all;
    all.include(0, 0);
    all.include(max_cell - 1, max_cell - 1);
    if (thin(all, true)) return std::move(kept_);
    plan_box filled;
    for (const plan_box& box : boxes_)
      for (const auto& corner : {box.min, std::array{box.max[0] - 1, box.max[1] - 1}})
        if (box.min[0] < box.max[0]) filled.include(corner[0], corner[1]);
    thin_in_parts(filled);
    return std::move(kept_);
  }

 private:
  void thin_in_parts(const plan_box& box) {
    const std::size_t axis = box.max[0] - box.min[0] >= box.max[1] - box.min[1] ? 0 : 1;
    plan_box low = box, high = box;
    low.max[axis] = high.min[axis] = (box.min[axis] + box.max[axis]) / 2;
    for (const plan_box& half : {low, high})
      if (!thin(half, false)) thin_in_parts(half);
  }

  /// Decides which points in the box are kept; false where it has more voxels than are held at once. On the
  /// first pass notes the boxes of the scans, whose points are passed to their end.
  bool thin(const plan_box& box, bool is_first) {
    const bool is_column = box.max[0] - box.min[0] == 1 && box.max[1] - box.min[1] == 1;
    number_set seen(is_column ? std::numeric_limits<std::size_t>::max() : max_voxels_);
    for (std::size_t s = 0; s < scans_.size(); ++s) {
      if (!is_first && !boxes_[s].meets(box)) continue;
      for_each_voxel(s, [&](std::size_t i, std::uint64_t voxel) {
        const auto x = std::int64_t(voxel >> (2 * axis_bits)),
                   y = std::int64_t((voxel >> axis_bits) & (max_cell - 1));
        if (is_first) boxes_[s].include(x, y);
        if (!seen.is_full() && box.holds(x, y)) kept_[s][i] = seen.insert(voxel);
      });
      if (!is_first && seen.is_full()) return false;
    }
    return !seen.is_full();
  }

  /// Calls `use(point, voxel)` for all points of a scan that are not left out, in their order.
  template <class Use>
  void for_each_voxel(std::size_t s, const Use& use) const {
    const execution exec{.threads = threads_};
    constexpr std::size_t block = 16 * point_source::block_size;
    std::vector<std::vector<std::uint64_t>> voxels(2 * std::size_t(detail::thread_count(exec)));
    const std::size_t size = scans_[s].scan->size();
    for (std::size_t begin = 0; begin < size; begin += voxels.size() * block) {
      const std::size_t blocks = std::min(voxels.size(), (size - begin + block - 1) / block);
      detail::parallel_for(
          exec, "voxels", blocks,
          [&](std::size_t b) {
            const std::size_t first = begin + b * block;
            find_voxels(scans_[s], first, std::min(block, size - first), voxels[b]);
          },
          1);
      for (std::size_t b = 0; b < blocks; ++b)
        for (std::size_t i = 0; i < voxels[b].size(); ++i)
          if (voxels[b][i] != no_voxel) use(begin + b * block + i, voxels[b][i]);
    }
  }

  void find_voxels(const placed_scan& scan, std::size_t first, std::size_t count,
                   std::vector<std::uint64_t>& voxels) const {
    std::vector<Eigen::Vector3d> points(count);
    scan.scan->points().read(first, points);
    voxels.assign(count, no_voxel);
    for (std::size_t i = 0; i < count; ++i) {
      if (!points[i].allFinite()) continue;
      const Eigen::Vector3d p = scan.target_from_scan * points[i];
      voxels[i] = 0;
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const double cell = std::floor(p[axis] / voxel_) - first_[axis];
        if (!(cell >= 0 && cell < double(max_cell)))
          throw std::invalid_argument("voxels of " + std::to_string(voxel_) +
                                      " m are too small for scans that reach so far; choose larger ones");
        voxels[i] = (voxels[i] << axis_bits) | std::uint64_t(cell);
      }
    }
  }

  std::span<const placed_scan> scans_;
  double voxel_;
  int threads_;
  std::size_t max_voxels_;
  Eigen::Vector3d first_ = Eigen::Vector3d::Zero();  // voxel of number 0 along each axis
  std::vector<plan_box> boxes_;                      // of the scans
  std::vector<std::vector<bool>> kept_;
};

class chosen_points final : public point_source {
 public:
  chosen_points(const point_source& all, const std::vector<bool>& kept) : all_(all), kept_(kept) {}

  std::size_t size() const override { return all_.size(); }
  void read(std::size_t first, std::span<Eigen::Vector3d> points) const override {
    all_.read(first, points);
    for (std::size_t i = 0; i < points.size(); ++i)
      if (!kept_[first + i]) points[i].setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  std::vector<attribute> attributes() const override { return all_.attributes(); }
  void read_attributes(std::size_t first, std::size_t count,
                       std::span<attribute_column> columns) const override {
    all_.read_attributes(first, count, columns);
  }

 private:
  const point_source& all_;
  const std::vector<bool>& kept_;
};

}  // namespace

std::vector<std::vector<bool>> first_in_voxels(std::span<const placed_scan> scans, double voxel, int threads,
                                               std::size_t max_voxels) {
  if (!(voxel > 0)) throw std::invalid_argument("voxel must be positive");
  return thinning(scans, voxel, threads, max_voxels).run();
}

scan_file with_points(const scan_file& scan, const std::vector<bool>& kept) {
  return scan_file({std::make_unique<chosen_points>(scan.points(), kept), scan.header()});
}

}  // namespace globalmatch::support

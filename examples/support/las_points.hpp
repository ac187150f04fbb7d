// Internal to the LAS reader: points before they are scaled, and what the file marks them as.
#pragma once

#include <Eigen/Core>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "support/point_source.hpp"

namespace globalmatch::support {

/// Coordinates as they are in the file: integers, which its header scales.
struct raw_point {
  std::int32_t x, y, z;
};

enum class point_mark : std::uint8_t { none, noise, withheld };

/// The classes 7 (low point) and 18 (high noise) are noise, withheld or not.
inline point_mark mark_of(unsigned class_number, bool is_withheld) {
  if (class_number == 7 || class_number == 18) return point_mark::noise;
  return is_withheld ? point_mark::withheld : point_mark::none;
}

/// Formats 0 to 5 have the class and the flags in one byte, number 15 of the record.
inline point_mark mark_of_class_byte(std::uint8_t byte) {
  return mark_of(byte & 0x1Fu, (byte & 0x80u) != 0);
}

/// Makes points of raw ones. May be called by several threads at once.
class point_scaling {
 public:
  /// Of a scan of `size` points. Points that are marked are not-a-number unless they are to be kept.
  point_scaling(const Eigen::Vector3d& scale, const Eigen::Vector3d& offset, bool keep_marked,
                std::size_t size);

  /// Scales the points from number `first` on. Counts the marks of the blocks that are whole among them and
  /// were not read before.
  void scale(std::size_t first, std::span<const raw_point> raw, std::span<const point_mark> marks,
             std::span<Eigen::Vector3d> points);

  std::size_t size() const { return size_; }
  marked_points marked() const { return {noise_, withheld_}; }

 private:
  void count(std::size_t first, std::span<const point_mark> marks);

  Eigen::Vector3d scale_, offset_;
  bool keep_marked_;
  std::size_t size_;
  std::unique_ptr<std::atomic<bool>[]> is_counted_;  // of each block
  std::atomic<std::size_t> noise_ = 0, withheld_ = 0;
};

}  // namespace globalmatch::support

// Files of points: scans in the formats that forest scanners and their programs write.
#pragma once

#include <Eigen/Core>

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "support/numbered_scans.hpp"
#include "support/point_source.hpp"

namespace globalmatch::support {

/// Reads the points of a source one after the other, in blocks; a copy reads blocks of its own. Each serves
/// one thread.
class point_iterator {
 public:
  using value_type = Eigen::Vector3d;
  using difference_type = std::ptrdiff_t;

  point_iterator() = default;
  point_iterator(const point_source* source, std::size_t i) : source_(source), i_(i) {}
  point_iterator(const point_iterator& other) : source_(other.source_), i_(other.i_) {}
  point_iterator(point_iterator&&) noexcept = default;
  point_iterator& operator=(const point_iterator& other) { return *this = point_iterator(other); }
  point_iterator& operator=(point_iterator&&) noexcept = default;
  ~point_iterator() = default;

  value_type operator*() const {
    if (i_ - first_ >= count_) read_block();
    return block_[i_ - first_];
  }
  /// Reads one point alone.
  value_type operator[](difference_type n) const;

  point_iterator& operator+=(difference_type n) {
    i_ += static_cast<std::size_t>(n);
    return *this;
  }
  point_iterator& operator-=(difference_type n) { return *this += -n; }
  point_iterator& operator++() {
    ++i_;
    return *this;
  }
  point_iterator& operator--() {
    --i_;
    return *this;
  }
  point_iterator operator++(int) { return {source_, i_++}; }
  point_iterator operator--(int) { return {source_, i_--}; }
  friend point_iterator operator+(const point_iterator& i, difference_type n) {
    return {i.source_, i.i_ + std::size_t(n)};
  }
  friend point_iterator operator+(difference_type n, const point_iterator& i) { return i + n; }
  friend point_iterator operator-(const point_iterator& i, difference_type n) { return i + -n; }
  friend difference_type operator-(const point_iterator& a, const point_iterator& b) {
    return static_cast<difference_type>(a.i_ - b.i_);
  }
  bool operator==(const point_iterator& other) const { return i_ == other.i_; }
  auto operator<=>(const point_iterator& other) const { return i_ <=> other.i_; }

 private:
  void read_block() const;

  const point_source* source_ = nullptr;
  std::size_t i_ = 0;
  mutable std::unique_ptr<Eigen::Vector3d[]> block_;  // points [first_, first_ + count_)
  mutable std::size_t first_ = 0, count_ = 0;
};

/// An open scan: its points as a range that `map_stems` takes as it is. Nothing is kept of a file whose
/// records all have one size; points are read when they are asked for, by several threads at once.
class scan_file {
 public:
  explicit scan_file(opened_scan scan) : scan_(std::move(scan)) {}

  point_iterator begin() const { return {scan_.points.get(), 0}; }
  point_iterator end() const { return {scan_.points.get(), size()}; }
  std::size_t size() const { return scan_.points->size(); }
  bool empty() const { return size() == 0; }

  const scan_header& header() const { return scan_.header; }
  const point_source& points() const { return *scan_.points; }
  /// The points that the file marks as no good, once all points were passed.
  marked_points marked() const { return scan_.points->marked(); }

 private:
  opened_scan scan_;
};

/// Opens a scan; `-` is standard input. The format is recognised by content, whatever the name: PLY, PCD,
/// LAS, LAZ, COPC, E57, PTX, or text with x, y and z in the columns that a header names so, or in the first
/// three where there is none; a header that names no coordinates is refused. Of a file of several scans one
/// is chosen by `name#K`, counted from 1; blocks of a PTS file are one scan unless one is chosen so. A folder
/// is one scan in tiles where `options.tiles` says so. The points are those of the file, in its order and
/// frame; those without coordinates, and those that the file marks as noise or withheld, unless they are to
/// be kept, are not-a-number. A scan may have no points. Throws `file_error` when the file cannot be read or
/// is damaged; the range throws it where damage shows only later.
scan_file open_scan(const std::filesystem::path& path, const scan_options& options = {});

using rgb = std::array<std::uint8_t, 3>;

/// Writes a binary little endian PLY; coordinates are float where that keeps 0.1 mm, else double. Throws
/// `file_error` when the file cannot be written, and `std::invalid_argument` when there are colours but not
/// one for each point.
void write_ply(const std::filesystem::path& path, std::span<const Eigen::Vector3d> points,
               std::span<const rgb> colours = {});

}  // namespace globalmatch::support

// Internal to the E57 reader: the points of a scan, decoded from the packets that hold them.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "support/e57_description.hpp"
#include "support/e57_pages.hpp"
#include "support/point_source.hpp"

namespace globalmatch::support {

/// The bytes of one field for all points: pieces of it are in each packet, and a value may be cut by their
/// borders.
class e57_stream {
 public:
  void append(std::uint64_t offset, std::uint64_t size);
  std::uint64_t size() const { return size_; }

  /// Fills `bytes` with those from `first` on, of which there must be enough.
  void read(const e57_pages& pages, std::uint64_t first, std::span<char> bytes) const;

 private:
  struct piece {
    std::uint64_t first;   // byte of the stream
    std::uint64_t offset;  // in the pages
  };
  std::vector<piece> pieces_;
  std::uint64_t size_ = 0;
};

/// Points without valid coordinates are not-a-number. Nothing is kept in memory but where the packets are.
class e57_points final : public point_source {
 public:
  /// Finds the packets, those of attributes only if they are wanted. Throws `file_error` when they hold less
  /// than all points.
  e57_points(std::shared_ptr<const e57_pages> pages, const e57_scan& scan, bool with_attributes);

  /// Whether the packets hold coordinates of further points, eight or more.
  bool has_more() const;

  std::size_t size() const override { return static_cast<std::size_t>(scan_.size); }
  void read(std::size_t first, std::span<Eigen::Vector3d> points) const override;
  std::vector<attribute> attributes() const override { return attributes_; }
  void read_attributes(std::size_t first, std::size_t count,
                       std::span<attribute_column> columns) const override;

 private:
  struct buffers;

  void find_packets();
  bool holds(std::uint64_t points) const;
  void add_packet(std::uint64_t packet, std::uint64_t size);
  void decode(std::size_t first, std::span<Eigen::Vector3d> points, buffers& room) const;
  void decode_field(std::size_t index, std::size_t first, std::span<double> values, char* bytes) const;

  std::shared_ptr<const e57_pages> pages_;
  e57_scan scan_;
  std::vector<e57_field> fields_;  // the coordinates, the invalid state where there is one, attributes
  std::vector<attribute> attributes_;
  std::vector<e57_stream> streams_;  // one for each field
};

}  // namespace globalmatch::support

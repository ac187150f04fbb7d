// Internal to the readers: points in binary records of one size, one behind the other.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "support/file_bytes.hpp"
#include "support/point_source.hpp"
#include "support/record_fields.hpp"
#include "support/scalars.hpp"

namespace globalmatch::support {

/// Where the records are in a file, and x, y and z in a record.
struct record_layout {
  std::uint64_t begin = 0;  ///< [bytes] of the first record from the start of the file
  std::size_t count = 0;
  std::size_t size = 0;                     ///< [bytes] of a record
  std::array<std::size_t, 3> offsets = {};  ///< [bytes] in a record
  std::array<scalar, 3> types = {};
  std::endian order = std::endian::little;
  std::vector<record_field> fields = {};  ///< attributes
};

/// Points that are read from the file whenever they are asked for.
class point_records final : public point_source {
 public:
  /// Throws `file_error` when the file ends before the last record.
  point_records(file_bytes file, record_layout layout);

  std::size_t size() const override { return layout_.count; }
  void read(std::size_t first, std::span<Eigen::Vector3d> points) const override;
  std::optional<class_counts> count_classes(const execution& exec) const override;
  std::vector<attribute> attributes() const override { return attributes_of(layout_.fields); }
  void read_attributes(std::size_t first, std::size_t count,
                       std::span<attribute_column> columns) const override;

 private:
  std::unique_ptr<char[]> read_records(std::size_t first, std::size_t count) const;

  file_bytes file_;
  record_layout layout_;
};

}  // namespace globalmatch::support

// Internal to the LAS reader: the header of a file, and the records between it and the points.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "support/file_bytes.hpp"
#include "support/record_fields.hpp"

namespace globalmatch::support {

/// [bytes] Of the headers of versions 1.0 to 1.2, to which later ones append, and of 1.4.
constexpr std::size_t las_header_size_1_2 = 227, las_header_size_1_4 = 375;

struct las_header {
  unsigned minor_version;          ///< of version 1
  unsigned format;                 ///< of the point records
  bool has_compressed_bits;        ///< compressors mark the format so
  std::uint16_t encoding;          ///< bits that say what times and projections are
  std::uint16_t size;              ///< [bytes] of the header
  std::uint32_t variable_records;  ///< between the header and the points; some writers miscount them
  std::uint64_t points_at;         ///< [bytes] from the start of the file
  std::size_t record_size;
  std::uint64_t count;            ///< of the points; 0: none, or not known
  std::uint64_t extended_at = 0;  ///< [bytes] records after the points; 0: there are none
  Eigen::Vector3d scale, offset;
  Eigen::Vector3d min, max;  ///< of coordinates, as the header says

  /// Whether classes and flags are those of the formats that came with LAS 1.4.
  bool is_long() const { return format >= 6; }
};

/// How the points of a file are compressed: the record of LASzip.
struct laszip_record {
  struct item {
    std::uint16_t type, size, version;
    bool operator==(const item&) const = default;
  };

  std::uint16_t compressor;
  std::uint32_t chunk_size;  ///< [points], unless `variable_chunks`
  std::vector<item> items;   ///< of a point record

  static constexpr std::uint32_t variable_chunks = 0xFFFFFFFF;
};

/// What the records between the header and the points say about the points.
struct las_records {
  std::optional<laszip_record> laszip;
  std::string extra_bytes;  ///< what describes the attributes behind those of the point format
  std::vector<std::pair<std::uint16_t, std::string>> projection;  ///< numbers and contents
  bool is_copc = false;
};

/// Throws `file_error` when there is no header that makes sense, or the file ends before its points.
las_header read_las_header(const file_bytes& file);

/// Throws `file_error` when the points are compressed and nothing says how.
las_records read_las_records(const file_bytes& file, const las_header& header);

/// "LAS 1.2, point format 3", or LAZ or COPC.
std::string las_format_name(const las_header& header, const las_records& records);

/// What each point has besides coordinates.
std::vector<std::string> las_attributes(const las_header& header, const las_records& records);

/// Where the attributes are in a record that are no wave packets.
std::vector<record_field> las_record_fields(const las_header& header, const las_records& records);

/// [bytes] of a record of the format without extra bytes; 0 if there is no such format.
std::size_t las_format_size(unsigned format);

}  // namespace globalmatch::support

// What the tests of the LAS reader share.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "file_checks.hpp"
#include "support/las.hpp"
#include "support/las_header.hpp"
#include "support/laz_chunk_decoder.hpp"
#include "support/laz_chunk_table.hpp"

namespace globalmatch::support {

inline opened_scan open_las_file(const std::filesystem::path& path, const scan_options& options = {}) {
  input_file file(path);
  return open_las(file, options);
}

/// All points of a source, read in runs of a size that blocks and chunks do not divide.
inline points all_points(const point_source& source, std::size_t run = 3000) {
  points read(source.size());
  for (std::size_t first = 0; first < read.size(); first += run)
    source.read(first, std::span(read).subspan(first, std::min(run, read.size() - first)));
  return read;
}

/// The points of a file that are not left out.
inline points read_las_file(const std::filesystem::path& path, const scan_options& options = {}) {
  points read = all_points(*open_las_file(path, options).points);
  std::erase_if(read, [](const Eigen::Vector3d& p) { return p.hasNaN(); });
  return read;
}

/// The whole records of a compressed file.
inline std::string decoded_records(const std::filesystem::path& path) {
  const file_bytes file(path);
  const las_header header = read_las_header(file);
  const las_records records = read_las_records(file, header);
  const laz::record_layout layout{header.format, header.record_size - las_format_size(header.format),
                                  records.laszip->items.front().version};
  laz::chunk_decoder decoder(file, layout);
  std::string decoded;
  for (const laz::chunk& chunk : laz::locate_chunks(file, header, *records.laszip, layout).chunks) {
    std::string part(chunk.count * header.record_size, '\0');
    decoder.decode_records(chunk, part);
    decoded += part;
  }
  return decoded;
}

}  // namespace globalmatch::support

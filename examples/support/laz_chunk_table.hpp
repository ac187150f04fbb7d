// Internal to the LAZ reader: where the chunks of a file are.
#pragma once

#include <vector>

#include "support/file_bytes.hpp"
#include "support/las_header.hpp"
#include "support/laz_layout.hpp"

namespace globalmatch::support::laz {

struct located_chunks {
  std::vector<chunk> chunks;
  bool has_more = false;  ///< the file has further points, behind those that its header announces
};

/// All chunks with points, in the order of the file, each in the bytes of the file and with no more points
/// than its bytes can hold. Where their table is missing or damaged they are found from the first on. Throws
/// `file_error` when they are not all there.
located_chunks locate_chunks(const file_bytes& file, const las_header& header, const laszip_record& laszip,
                             const record_layout& layout);

}  // namespace globalmatch::support::laz

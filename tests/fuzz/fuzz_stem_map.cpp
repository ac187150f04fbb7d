// Stem map files, whole and damaged, with checksums that fit: a map that is written again as the same map, or
// an error.
#include <stdexcept>
#include <string>

#include "fuzz_input.hpp"
#include "stem_map_bytes.hpp"

using namespace globalmatch;

namespace {

/// Reads and writes a file, whose parts must agree. Empty where it is refused.
std::string written_again(const std::string& bytes) {
  try {
    const stem_map_file file = read_back(bytes);
    fuzz::require(read_back(bytes, stem_map_file::parts::stems).map.stems.size() == file.map.stems.size(),
                  "the stems are those of the whole file");
    return bytes_of(file.map, file.provenance);
  } catch (const std::runtime_error&) {
    return {};
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string bytes(reinterpret_cast<const char*>(data), size);
  written_again(bytes);
  seal_stem_map(bytes);
  const std::string once = written_again(bytes);
  if (!once.empty())
    fuzz::require(written_again(once) == once, "what was written is written with the same bytes");
  return 0;
}

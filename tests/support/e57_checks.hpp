// What the tests of E57 files share: the reader, by the name of a file.
#pragma once

#include <cstddef>
#include <filesystem>

#include "support/e57.hpp"
#include "support/input_file.hpp"

namespace globalmatch::support {

inline std::size_t count_scans_of(const std::filesystem::path& path) {
  input_file file(path);
  return count_e57_scans(file);
}

inline opened_scan open_e57_file(const std::filesystem::path& path, std::size_t number) {
  input_file file(path);
  return open_e57(file, number, {});
}

}  // namespace globalmatch::support

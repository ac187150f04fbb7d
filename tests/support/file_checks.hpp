// What the tests of readers share: files made of bytes, and what their errors must say.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "catch.hpp"
#include "support/file_error.hpp"
#include "support/scan_files.hpp"
#include "temporary_directory.hpp"

namespace globalmatch::support {

using points = std::vector<Eigen::Vector3d>;

/// All points of a scan.
inline constexpr auto read_scan = [](const std::filesystem::path& path, const scan_options& options = {}) {
  const scan_file scan = open_scan(path, options);
  return points(scan.begin(), scan.end());
};

/// Puts the bytes of a value behind the others, in the given byte order.
template <class T>
void put(std::string& bytes, T value, std::endian order = std::endian::little) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  if (order != std::endian::native) std::reverse(raw, raw + sizeof(T));
  bytes.append(raw, sizeof(T));
}

/// Overwrites bytes with those of a little endian value.
template <class T>
void put_at(std::string& bytes, std::size_t offset, T value) {
  std::string raw;
  put(raw, value);
  bytes.replace(offset, raw.size(), raw);
}

/// The message of the `file_error` that reading must throw; empty when it throws none.
template <class Read>
std::string error_of(const Read& read) {
  try {
    read();
  } catch (const file_error& error) {
    return error.what();
  }
  return {};
}

/// Reading the file must fail with an error that names it, the problem, and then a remedy.
template <class Read>
void require_error(const std::filesystem::path& path, const Read& read, const std::string& problem,
                   const std::string& remedy) {
  const std::string message = error_of([&] { read(path); });
  using Catch::Matchers::Contains;
  CHECK_THAT(message, Contains(path.string()) && Contains(problem) && Contains(remedy));
}

}  // namespace globalmatch::support

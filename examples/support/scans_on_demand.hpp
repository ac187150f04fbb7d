// Scans of which one at a time is open, so that any number of them can be passed one after the other.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>

#include "support/scan_files.hpp"

namespace globalmatch::support {

/// Opens scans, and keeps the last one. May be used by several threads at once.
class scan_opener {
 public:
  explicit scan_opener(const scan_options& options) : options_(options) {}

  /// Throws `file_error`.
  std::shared_ptr<const scan_file> open(const std::filesystem::path& path);

 private:
  scan_options options_;
  std::mutex mutex_;
  std::filesystem::path path_;
  std::shared_ptr<const scan_file> scan_;
};

/// A scan that is opened now, for what its file says of it, and again whenever its points are read while
/// another one is open. Throws `file_error`, also when it is read, where its number of points has changed.
scan_file open_on_demand(const std::filesystem::path& path, const std::shared_ptr<scan_opener>& opener);

}  // namespace globalmatch::support

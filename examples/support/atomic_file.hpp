// A file that is written whole or not at all.
#pragma once

#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <ostream>

namespace globalmatch::support {

/// Collects what is written in a temporary sibling of `path`, which takes the place of `path` on `commit()`.
/// Without `commit()` the sibling is removed and whatever was at `path` stays as it was. Numbers are written
/// with 17 significant digits (a double read back is the same bits) and a decimal point in every locale.
/// Devices and pipes, e.g. /dev/stdout, are written directly.
class atomic_file {
 public:
  /// Throws `file_error` when `path` is a directory, or its directory is missing or not writable.
  explicit atomic_file(const std::filesystem::path& path);
  ~atomic_file();
  atomic_file(const atomic_file&) = delete;
  atomic_file& operator=(const atomic_file&) = delete;

  std::ostream& stream() { return stream_; }

  /// Throws `file_error` when not everything could be written so far. To be asked during long work.
  void require_good() const;

  /// Puts the file in its place. Throws `file_error` when not everything could be written.
  void commit();

 private:
  std::filesystem::path path_;
  std::filesystem::path
      written_;  ///< the temporary sibling; `path_` itself for devices; empty when committed
  std::ofstream stream_;
};

/// Throws `file_error` for the first of these files that could not be written; empty paths are skipped. To be
/// asked before long work. Leaves nothing behind.
void require_writable(std::initializer_list<std::filesystem::path> paths);

/// Removes the temporary files in a folder whose process on this host has ended without removing them, and
/// those of other hosts that are a day old.
void remove_abandoned(const std::filesystem::path& folder);

/// Makes a folder, and those that it lies in, where they are missing. Throws `file_error`.
void make_folder(const std::filesystem::path& path);

}  // namespace globalmatch::support

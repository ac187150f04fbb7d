// Internal to the readers: a stream that can be read once becomes a file that can be read at any place.
#pragma once

#include <cstdio>
#include <filesystem>
#include <string_view>

namespace globalmatch::support {

/// A file in the folder for temporary files, with all that a stream holds from where it is on. It is removed
/// at the end of its life.
class temporary_copy {
 public:
  /// Throws `file_error`, which calls the stream `name`.
  temporary_copy(std::FILE* from, std::string_view name);
  ~temporary_copy() { remove(); }
  temporary_copy(const temporary_copy&) = delete;
  temporary_copy& operator=(const temporary_copy&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Removes the file now, if the system lets go of files that are open; who has opened it reads on.
  void remove() noexcept;

 private:
  std::filesystem::path path_;
};

}  // namespace globalmatch::support

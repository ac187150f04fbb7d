// Internal to the readers: a stream that can be read once becomes a file that can be read at any place.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string_view>

namespace globalmatch::support {

/// A new file in the folder for temporary files, that nobody else can read. It is removed at the end of its
/// life.
class temporary_file {
 public:
  /// Throws `file_error`, which says that a copy of the stream `name` is needed.
  explicit temporary_file(std::string_view name);
  ~temporary_file() {
    file_.reset();  // Windows removes no file that is open
    remove();
  }
  temporary_file(const temporary_file&) = delete;
  temporary_file& operator=(const temporary_file&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Removes the file now, if the system lets go of files that are open; who has opened it reads on.
  void remove() noexcept;

  /// Writes all that a stream holds from where it is on, and returns how many bytes that is. Throws
  /// `file_error` when the stream cannot be read or the disk is full.
  std::uint64_t copy_from(std::FILE* stream);

 private:
  struct closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  std::filesystem::path name_, path_;
  std::unique_ptr<std::FILE, closer> file_;
};

}  // namespace globalmatch::support

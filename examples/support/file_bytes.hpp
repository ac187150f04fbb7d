// Internal to the readers: a file read at any place, by several threads at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <ostream>
#include <span>
#include <string_view>

namespace globalmatch::support {

/// A regular file of known size. It is read, not mapped: a file that is cut off meanwhile is an error like
/// any other, and no signal. Copies share the open file.
class file_bytes {
 public:
  /// The path `-` is standard input, all of it, however often it is opened. Throws `file_error` when there is
  /// no regular file at `path` or it cannot be opened.
  explicit file_bytes(std::filesystem::path path);

  /// As messages name the file.
  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }

  /// Fills `bytes` with what starts at `offset`. Throws `file_error` when the file ends before. May be called
  /// by several threads at once.
  void read(std::uint64_t offset, std::span<char> bytes) const;

  /// Throws `file_error` for the file as a whole.
  [[noreturn]] void fail(std::string_view problem, std::string_view remedy) const;
  /// Throws `file_error` for a file that holds less than its header says.
  [[noreturn]] void fail_truncated() const;

 private:
  struct handle;
  static const file_bytes& of_standard_input();
  void open();

  std::filesystem::path path_;
  std::uint64_t size_ = 0;
  std::shared_ptr<const handle> handle_;
};

/// Writes the bytes [begin, end) of a file, in blocks. Throws `file_error` when the file ends before.
void copy_bytes(const file_bytes& file, std::uint64_t begin, std::uint64_t end, std::ostream& out);

}  // namespace globalmatch::support

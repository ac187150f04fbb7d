// Internal to the readers: a file read from front to back in large blocks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "support/file_bytes.hpp"

namespace globalmatch::support {

/// A regular file of known size with a cursor in it. No call allocates more than the file holds, whatever
/// sizes the file claims. Bytes and lines that are handed out stay valid until the next call.
class input_file {
 public:
  /// Throws `file_error` when there is no regular file at `path` or it cannot be opened. A UTF-8 byte order
  /// mark is passed over; text in UTF-16, which starts with one, is made UTF-8.
  explicit input_file(std::filesystem::path path);

  const std::filesystem::path& path() const { return file_.path(); }
  /// The same open file, to be read at any place.
  const file_bytes& bytes() const { return file_; }
  /// [bytes] of the cursor from the start of the file, for binary data. Throws `file_error` where text was
  /// made UTF-8: what follows a header in UTF-16 can be no such data.
  std::uint64_t offset() const;
  /// Bytes from the cursor to the end of the file.
  std::uint64_t remaining() const { return buffered() + unread_; }
  /// Lines handed out so far: the number of the current line, counted from 1.
  std::size_t line_number() const { return line_number_; }

  /// The next bytes without moving the cursor: `count` of them, or all there are.
  std::string_view peek(std::size_t count);

  /// The next `count` bytes. Throws `file_error` when the file ends before.
  const char* read(std::size_t count) {
    if (count > buffered()) fetch(count);
    const char* bytes = buffer_.data() + begin_;
    begin_ += count;
    return bytes;
  }

  /// Moves the cursor. Throws `file_error` when the file ends before.
  void skip(std::uint64_t count);

  /// The next line without its line end (LF or CRLF, or CR if the first line ends so); empty at the end of
  /// the file. Throws `file_error` when a line is too long for any text file.
  std::optional<std::string_view> read_line();

  /// Throws `file_error` for the file as a whole.
  [[noreturn]] void fail(std::string_view problem, std::string_view remedy) const;
  /// Throws `file_error` for the current line.
  [[noreturn]] void fail_at_line(std::string_view problem, std::string_view remedy) const;
  /// Throws `file_error` for a file that holds less than its header says.
  [[noreturn]] void fail_truncated() const;

 private:
  std::size_t buffered() const { return end_ - begin_; }
  void fetch(std::size_t count);
  void decode_utf16(bool big_endian);
  char line_end_of_first();

  file_bytes file_;
  std::uint64_t unread_ = 0;  ///< bytes at the end of the file that have not come into the buffer yet
  std::vector<char> buffer_;
  std::size_t begin_ = 0;  ///< the cursor in the buffer
  std::size_t end_ = 0;
  std::size_t line_number_ = 0;
  char line_end_ = '\n';
  bool was_decoded_ = false;  ///< from UTF-16
};

}  // namespace globalmatch::support

#include "support/input_file.hpp"

#include <algorithm>
#include <cstring>
#include <system_error>
#include <utility>

#include "support/file_error.hpp"

namespace globalmatch::support {

namespace {
constexpr std::size_t block_size = 1 << 20;
constexpr std::size_t longest_line = block_size;
}  // namespace

input_file::input_file(std::filesystem::path path) : path_(std::move(path)) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (!fs::exists(path_, ignored)) fail("does not exist", "Check the spelling and the current directory");
  if (!fs::is_regular_file(path_, ignored)) fail("is not a regular file", "Name a file on disk");
  stream_.open(path_, std::ios::binary);
  if (!stream_) fail("cannot be opened for reading", "Check the permissions of the file");
  unread_ = fs::file_size(path_);
  buffer_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(block_size, unread_)));
  if (peek(3) == "\xEF\xBB\xBF") skip(3);
}

std::string_view input_file::peek(std::size_t count) {
  count = static_cast<std::size_t>(std::min<std::uint64_t>(count, remaining()));
  if (count > buffered()) fetch(count);
  return {buffer_.data() + begin_, count};
}

void input_file::skip(std::uint64_t count) {
  if (count > remaining()) fail_truncated();
  const std::uint64_t from_buffer = std::min<std::uint64_t>(count, buffered());
  begin_ += static_cast<std::size_t>(from_buffer);
  unread_ -= count - from_buffer;
  if (count > from_buffer) stream_.seekg(static_cast<std::streamoff>(count - from_buffer), std::ios::cur);
}

std::optional<std::string_view> input_file::read_line() {
  if (remaining() == 0) return std::nullopt;
  ++line_number_;
  if (!std::memchr(buffer_.data() + begin_, '\n', buffered())) peek(longest_line);
  const char* first = buffer_.data() + begin_;
  const auto* end = static_cast<const char*>(std::memchr(first, '\n', buffered()));
  if (!end && unread_ > 0)
    fail_at_line("is longer than any line of text should be",
                 "This is probably no text file, or one in an unknown format");
  std::string_view line(first, end ? static_cast<std::size_t>(end - first) : buffered());
  begin_ += line.size() + (end ? 1 : 0);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

// Brings at least `count` bytes into the buffer.
void input_file::fetch(std::size_t count) {
  if (count > remaining()) fail_truncated();
  std::memmove(buffer_.data(), buffer_.data() + begin_, buffered());
  end_ = buffered();
  begin_ = 0;
  if (count > buffer_.size()) buffer_.resize(count);
  const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(buffer_.size() - end_, unread_));
  stream_.read(buffer_.data() + end_, static_cast<std::streamsize>(wanted));
  if (static_cast<std::size_t>(stream_.gcount()) != wanted) fail_truncated();
  end_ += wanted;
  unread_ -= wanted;
}

void input_file::fail(std::string_view problem, std::string_view remedy) const {
  throw file_error(path_, problem, remedy);
}

void input_file::fail_at_line(std::string_view problem, std::string_view remedy) const {
  fail("line " + std::to_string(line_number_) + " " + std::string(problem), remedy);
}

void input_file::fail_truncated() const {
  fail("ends before all the data that its header announces",
       "It is probably truncated: copy or export it again");
}

}  // namespace globalmatch::support

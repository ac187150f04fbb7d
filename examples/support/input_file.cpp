#include "support/input_file.hpp"

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

namespace globalmatch::support {

namespace {
constexpr std::size_t bytes_at_once = 1 << 20;
constexpr std::size_t longest_line = bytes_at_once;
}  // namespace

input_file::input_file(std::filesystem::path path) : file_(std::move(path)), unread_(file_.size()) {
  buffer_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(bytes_at_once, unread_)));
  if (peek(3) == "\xEF\xBB\xBF") skip(3);
  if (peek(2) == "\xFF\xFE" || peek(2) == "\xFE\xFF") decode_utf16(peek(1) == "\xFE");
}

// Puts all of the file into the buffer, as UTF-8.
void input_file::decode_utf16(bool big_endian) {
  skip(2);
  const std::size_t units = remaining() / 2;
  const std::string_view bytes = peek(2 * units);
  const auto unit = [&](std::size_t i) {
    const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(bytes[k]); };
    return static_cast<char32_t>(big_endian ? byte(2 * i) << 8 | byte(2 * i + 1)
                                            : byte(2 * i + 1) << 8 | byte(2 * i));
  };
  std::vector<char> text;
  text.reserve(units);
  for (std::size_t i = 0; i < units; ++i) {
    char32_t c = unit(i);
    const bool is_pair =
        c >= 0xD800 && c < 0xDC00 && i + 1 < units && unit(i + 1) >= 0xDC00 && unit(i + 1) < 0xE000;
    if (is_pair) c = 0x10000 + ((c - 0xD800) << 10) + (unit(++i) - 0xDC00);
    const int continued = c < 0x80 ? 0 : c < 0x800 ? 1 : c < 0x10000 ? 2 : 3;
    constexpr unsigned char first[] = {0, 0xC0, 0xE0, 0xF0};
    text.push_back(static_cast<char>(first[continued] | c >> (6 * continued)));
    for (int k = continued - 1; k >= 0; --k)
      text.push_back(static_cast<char>(0x80 | ((c >> (6 * k)) & 0x3F)));
  }
  buffer_ = std::move(text);
  begin_ = unread_ = 0;
  end_ = buffer_.size();
  was_decoded_ = true;
}

std::uint64_t input_file::offset() const {
  if (was_decoded_)
    fail("has a header in UTF-16, but binary data", "Export it again, as text or with a header in ASCII");
  return file_.size() - remaining();
}

// A file of the old Macintosh ends its lines by CR alone.
char input_file::line_end_of_first() {
  const std::string_view start = peek(longest_line);
  const std::size_t end = start.find_first_of("\r\n");
  const bool is_cr = end != std::string_view::npos && start[end] == '\r';
  return is_cr && end + 1 < start.size() && start[end + 1] != '\n' ? '\r' : '\n';
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
}

std::optional<std::string_view> input_file::read_line() {
  if (remaining() == 0) return std::nullopt;
  if (line_number_++ == 0) line_end_ = line_end_of_first();
  if (!std::memchr(buffer_.data() + begin_, line_end_, buffered())) peek(longest_line);
  const char* first = buffer_.data() + begin_;
  const auto* end = static_cast<const char*>(std::memchr(first, line_end_, buffered()));
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
  file_.read(file_.size() - unread_, {buffer_.data() + end_, wanted});
  end_ += wanted;
  unread_ -= wanted;
}

void input_file::fail(std::string_view problem, std::string_view remedy) const {
  file_.fail(problem, remedy);
}

void input_file::fail_at_line(std::string_view problem, std::string_view remedy) const {
  fail("line " + std::to_string(line_number_) + " " + std::string(problem), remedy);
}

void input_file::fail_truncated() const {
  file_.fail_truncated();
}

}  // namespace globalmatch::support

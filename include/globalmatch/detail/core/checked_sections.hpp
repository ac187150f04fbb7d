// A file of named sections, each with its length and its checksum in a table in front, so that a reader skips
// what it does not need.
//
//   signature    8 bytes
//   version      uint32
//   sections     uint32, and of each: name (4 bytes), CRC-32C of its bytes (uint32), its length (uint64)
//   checksum     uint32, CRC-32C of all before
//   the bytes of the sections, one after the other
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <istream>
#include <limits>
#include <ostream>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/byte_archives.hpp"
#include "globalmatch/detail/core/crc32c.hpp"

namespace globalmatch::detail {

/// A kind of files of sections.
struct sections_format {
  std::string_view signature;                     ///< 8 bytes
  std::string_view name;                          ///< for messages, as in "stem map"
  std::uint32_t oldest = 1, version = 1;          ///< what is read; the latter is written
  std::span<const std::string_view> sections;     ///< names of 4 characters, in their order
  std::size_t sections_before = sections.size();  ///< of these, the first, in files of older versions
};

/// Writes a file. `contents`: bytes of each section. Throws `std::runtime_error` when the stream fails.
inline void write_sections(std::ostream& out, const sections_format& format,
                           std::span<const std::string> contents) {
  output_archive table;
  for (const char c : format.signature) table(c);
  table(format.version, static_cast<std::uint32_t>(contents.size()));
  for (std::size_t i = 0; i < contents.size(); ++i) {
    for (const char c : format.sections[i]) table(c);
    table(crc32c(contents[i]));
    table.count(contents[i].size());
  }
  table(crc32c(table.bytes()));
  const auto write = [&out](const std::string& bytes) {
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  };
  write(table.bytes());
  for (const std::string& content : contents) write(content);
  if (!out) throw std::runtime_error("the " + std::string(format.name) + " file could not be written whole");
}

/// Reads such a file section by section, and nothing behind it. Everything throws `std::runtime_error` for a
/// file of another kind, of a version that this library does not read, that is cut off, or damaged.
class section_reader {
 public:
  /// Reads the table. `in` and `format` must outlive the reader.
  section_reader(std::istream& in, const sections_format& format) : in_(in), format_(format) {
    if (!in) fail("cannot be read");
    std::string head = take(format.signature.size());
    if (head != format.signature.substr(0, head.size())) fail("is of another kind: it begins otherwise");
    if (head.size() < format.signature.size()) fail_truncated();
    head += take_all(sizeof(std::uint32_t));
    const auto version = load_little_endian<std::uint32_t>(&head[format.signature.size()]);
    check_version(version);
    read_table(std::move(head), version < format.version ? format.sections_before : format.sections.size());
  }

  /// The bytes of the next section.
  std::string read() {
    const entry& e = next();
    std::string bytes = take_all(e.length);
    if (crc32c(bytes) != e.checksum) fail_damaged("its section '" + name() + "'");
    ++next_;
    return bytes;
  }

  /// Passes over the next section, which is not checked but for its length.
  void skip() {
    const std::uint64_t length = next().length;
    ++next_;
    if (length == 0) return;
    constexpr auto largest = std::uint64_t(std::numeric_limits<std::streamoff>::max());
    if (length >= largest) fail_truncated();
    if (in_.tellg() == std::istream::pos_type(-1))  // a pipe
      in_.ignore(static_cast<std::streamsize>(length - 1));
    else
      in_.seekg(static_cast<std::streamoff>(length - 1), std::ios::cur);
    if (in_.get() == std::istream::traits_type::eof()) fail_truncated();  // seeking alone goes beyond the end
  }

  /// Whether there is another section: those that a version added are not in older files.
  bool has_next() const { return next_ < entries_.size(); }

  /// Of the next section.
  std::string name() const { return std::string(format_.sections[next_]); }

 private:
  struct entry {
    std::uint32_t checksum = 0;
    std::uint64_t length = 0;
  };

  /// As many bytes as there are, at most `length`. Memory follows what is there, not what `length` says.
  std::string take(std::uint64_t length) {
    constexpr std::size_t first = 1 << 16;
    std::string bytes;
    while (bytes.size() < length) {
      const std::size_t old = bytes.size();
      const auto step = static_cast<std::size_t>(
          std::min<std::uint64_t>(length - old, std::max<std::uint64_t>(old, first)));
      bytes.resize(old + step);
      in_.read(&bytes[old], static_cast<std::streamsize>(step));
      const auto got = static_cast<std::size_t>(in_.gcount());
      if (got < step) {
        bytes.resize(old + got);
        break;
      }
    }
    return bytes;
  }
  std::string take_all(std::uint64_t length) {
    std::string bytes = take(length);
    if (bytes.size() < length) fail_truncated();
    return bytes;
  }

  void check_version(std::uint32_t version) const {
    const std::string is = "is of version " + std::to_string(version) + "; this library reads ";
    if (version > format_.version) fail(is + "up to " + std::to_string(format_.version) + ": update it");
    if (version < format_.oldest) fail(is + "from " + std::to_string(format_.oldest) + " on: make it again");
  }

  void read_table(std::string head, std::size_t count) {
    constexpr std::size_t entry_size = 4 + sizeof(std::uint32_t) + sizeof(std::uint64_t);
    const std::size_t start = head.size() + sizeof(std::uint32_t);
    head += take_all(sizeof(std::uint32_t) + count * entry_size);
    const std::string checksum = take_all(sizeof(std::uint32_t));
    if (crc32c(head) != load_little_endian<std::uint32_t>(checksum.data()) ||
        load_little_endian<std::uint32_t>(&head[start - sizeof(std::uint32_t)]) != count)
      fail_damaged("its table of sections");
    for (std::size_t i = 0; i < count; ++i) {
      const char* at = &head[start + i * entry_size];
      if (std::string_view(at, 4) != format_.sections[i]) fail_damaged("its table of sections");
      entries_.push_back(
          {load_little_endian<std::uint32_t>(at + 4), load_little_endian<std::uint64_t>(at + 8)});
    }
  }

  const entry& next() const {
    if (!has_next()) throw std::logic_error("there is no further section");
    return entries_[next_];
  }
  [[noreturn]] void fail(const std::string& problem) const {
    throw std::runtime_error("the " + std::string(format_.name) + " file " + problem);
  }
  [[noreturn]] void fail_truncated() const {
    fail("is cut off: it ends before its last section does; copy it again, or make it again");
  }
  [[noreturn]] void fail_damaged(const std::string& part) const {
    fail("is damaged: " + part + " does not fit its checksum; copy it again, or make it again");
  }

  std::istream& in_;
  const sections_format& format_;
  std::vector<entry> entries_;
  std::size_t next_ = 0;
};

}  // namespace globalmatch::detail

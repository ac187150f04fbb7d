// Internal to the E57 reader: the pages that an E57 file is cut into, and its header.
#pragma once

#include <cstdint>
#include <ostream>
#include <span>
#include <string>
#include <string_view>

#include "support/file_bytes.hpp"

namespace globalmatch::support {

/// An E57 file without the checksums that end its pages: 1020 of 1024 bytes are content. Offsets count the
/// content alone. All functions may be called by several threads at once.
class e57_pages {
 public:
  /// Throws `file_error` when this is no E57 file of version 1, or is shorter than its header says.
  explicit e57_pages(file_bytes file);

  const std::string& version() const { return version_; }
  /// The XML that describes the scans.
  std::string read_xml() const;

  /// [bytes] of content.
  std::uint64_t size() const { return pages_ * content_size; }
  /// The offset of what is at a byte of the file. Throws `file_error` where that is no content.
  std::uint64_t offset_of(std::uint64_t byte_of_file) const;

  /// Fills `bytes` with the content from `offset` on. Throws `file_error` where a page does not fit its
  /// checksum, or the file ends before.
  void read(std::uint64_t offset, std::span<char> bytes) const;

  /// Writes the file with another description of its scans; points stay where they are.
  void write_with_xml(std::ostream& out, std::string_view xml) const;

  /// Throws `file_error` for the file as a whole.
  [[noreturn]] void fail(std::string_view problem, std::string_view remedy) const;
  /// Throws `file_error` for content that is not as the format has it.
  [[noreturn]] void fail_damaged(std::string_view problem) const;
  /// Throws `file_error` for a file that holds less than its header says.
  [[noreturn]] void fail_truncated() const { file_.fail_truncated(); }

 private:
  static constexpr std::uint64_t page_size = 1024, content_size = 1020;
  void read_header();
  /// Whether the file holds nothing more than the rest of a page of zeros.
  bool is_empty_from(std::uint64_t offset) const;

  file_bytes file_;
  std::uint64_t pages_;
  std::string version_;
  std::uint64_t xml_offset_ = 0, xml_size_ = 0;
};

}  // namespace globalmatch::support

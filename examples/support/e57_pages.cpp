#include "support/e57_pages.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <memory>
#include <utility>

#include "globalmatch/detail/core/crc32c.hpp"
#include "support/scalars.hpp"

namespace globalmatch::support {

namespace {

constexpr std::string_view signature = "ASTM-E57";

template <class T>
T field(std::span<const char> bytes, std::size_t at) {
  return load<T>(bytes.data() + at, std::endian::little);
}

}  // namespace

e57_pages::e57_pages(file_bytes file) : file_(std::move(file)), pages_(file_.size() / page_size) {
  read_header();
}

void e57_pages::read_header() {
  std::array<char, 48> header;
  file_.read(0, header);  // not through the pages, so that another version is said to be one
  if (std::string_view(header.data(), signature.size()) != signature)
    fail("is no E57 file", "Export the scan again, as E57, PLY or LAS");
  const auto major = field<std::uint32_t>(header, 8), minor = field<std::uint32_t>(header, 12);
  version_ = std::to_string(major) + "." + std::to_string(minor);
  if (major != 1 || field<std::uint64_t>(header, 40) != page_size)
    fail("is E57 " + version_ + " with pages of " + std::to_string(field<std::uint64_t>(header, 40)) +
             " bytes, of which only version 1 with pages of 1024 is known",
         "Export the scan again, as E57 1.0, PLY or LAS");
  if (field<std::uint64_t>(header, 16) > file_.size()) fail_truncated();
  read(0, header);
  xml_size_ = field<std::uint64_t>(header, 32);
  if (xml_size_ == 0)
    fail("holds no description of its scans: the program that wrote it stopped before the end",
         "Export the scan again");
  if (xml_size_ > size()) fail_truncated();
  xml_offset_ = offset_of(field<std::uint64_t>(header, 24));
}

std::string e57_pages::read_xml() const {
  std::string xml(static_cast<std::size_t>(xml_size_), '\0');
  read(xml_offset_, xml);
  return xml;
}

std::uint64_t e57_pages::offset_of(std::uint64_t byte_of_file) const {
  const std::uint64_t page = byte_of_file / page_size, within = byte_of_file % page_size;
  if (page >= pages_) fail_truncated();
  if (within >= content_size) fail_damaged("refers to a checksum as if it were content");
  return page * content_size + within;
}

void e57_pages::read(std::uint64_t offset, std::span<char> bytes) const {
  constexpr std::uint64_t pages_at_once = 32;
  const std::uint64_t most = std::min<std::uint64_t>(bytes.size() / content_size + 2, pages_at_once);
  const auto buffer = std::make_unique_for_overwrite<char[]>(static_cast<std::size_t>(most * page_size));
  while (!bytes.empty()) {
    const std::uint64_t first = offset / content_size;
    std::uint64_t skipped = offset % content_size;
    const std::uint64_t needed = (skipped + bytes.size() + content_size - 1) / content_size;
    const std::uint64_t count = std::min(needed, pages_at_once);
    if (first >= pages_ || count > pages_ - first) fail_truncated();
    file_.read(first * page_size, {buffer.get(), static_cast<std::size_t>(count * page_size)});
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::span<const char> page(buffer.get() + i * page_size, page_size);
      if (detail::crc32c(page.first(content_size)) !=
          load<std::uint32_t>(&page[content_size], std::endian::big))
        fail("is damaged in its page " + std::to_string(first + i) + " (bytes " +
                 std::to_string((first + i) * page_size) + " and on), which does not fit its checksum",
             "Copy the file again from where it was made, or export the scan again");
      const auto copied = std::min<std::size_t>(bytes.size(), content_size - skipped);
      std::memcpy(bytes.data(), page.data() + skipped, copied);
      bytes = bytes.subspan(copied);
      offset += copied;
      skipped = 0;
    }
  }
}

bool e57_pages::is_empty_from(std::uint64_t offset) const {
  if (size() - offset >= content_size) return false;
  std::array<char, content_size> bytes;
  const std::span rest = std::span(bytes).first(static_cast<std::size_t>(size() - offset));
  read(offset, rest);
  return std::ranges::all_of(rest, [](char byte) { return byte == '\0'; });
}

void e57_pages::write_with_xml(std::ostream& out, std::string_view xml) const {
  // Most writers put the description last: then it is replaced, else it goes unread.
  const bool is_last = is_empty_from(xml_offset_ + xml_size_);
  const std::uint64_t begin = is_last ? xml_offset_ : size(), end = begin + xml.size(),
                      pages = (end + content_size - 1) / content_size;
  const auto write_page = [&](std::uint64_t number) {
    const std::uint64_t first = number * content_size;
    std::array<char, page_size> page = {};
    const std::span content(page.data(), content_size);
    if (first < begin)
      read(first, content.first(static_cast<std::size_t>(std::min(content_size, begin - first))));
    for (std::uint64_t i = std::max(first, begin); i < std::min(first + content_size, end); ++i)
      content[static_cast<std::size_t>(i - first)] = xml[static_cast<std::size_t>(i - begin)];
    if (number == 0) {
      store(pages * page_size, &content[16], std::endian::little);
      store(begin / content_size * page_size + begin % content_size, &content[24], std::endian::little);
      store(std::uint64_t(xml.size()), &content[32], std::endian::little);
    }
    store(detail::crc32c(content), &page[content_size], std::endian::big);
    out.write(page.data(), page_size);
  };
  const std::uint64_t first_changed = std::max<std::uint64_t>(1, begin / content_size);
  write_page(0);
  copy_bytes(file_, page_size, first_changed * page_size, out);
  for (std::uint64_t number = first_changed; number < pages; ++number) write_page(number);
}

void e57_pages::fail(std::string_view problem, std::string_view remedy) const {
  file_.fail(problem, remedy);
}

void e57_pages::fail_damaged(std::string_view problem) const {
  fail(std::string(problem) + ", so it is damaged or was written by a program with an error",
       "Copy or export the scan again, as E57, PLY or LAS");
}

}  // namespace globalmatch::support

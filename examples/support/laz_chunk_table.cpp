#include "support/laz_chunk_table.hpp"

#include <algorithm>
#include <bit>
#include <memory>
#include <optional>
#include <string>

#include "support/laz_arithmetic.hpp"
#include "support/laz_chunk_decoder.hpp"
#include "support/laz_integers.hpp"
#include "support/scalars.hpp"

namespace globalmatch::support::laz {

namespace {

// Of a point, each of at least four symbols is coded in log2(1 + 32/32768) bits or more, because no other
// symbol of a model is rarer than one in 2^15, and models have 33 symbols and more.
constexpr std::uint64_t max_points_per_byte = 2048;

/// What a table says of a chunk.
struct table_entry {
  std::uint32_t count, size;
};

class chunk_locator {
 public:
  chunk_locator(const file_bytes& file, const las_header& header, const laszip_record& laszip,
                const record_layout& layout)
      : file_(file), header_(header), laszip_(laszip), layout_(layout) {}

  located_chunks locate() {
    find_chunks();
    return {std::move(chunks_), has_more_ || has_more_in_last()};
  }

 private:
  void find_chunks() {
    if (file_.size() - header_.points_at < 8) file_.fail_truncated();
    table_at_ = number_at<std::uint64_t>(header_.points_at);
    if (table_at_ == ~std::uint64_t(0)) table_at_ = number_at<std::uint64_t>(file_.size() - 8);
    if (has_table() && follow_table(read_table())) return;
    chunks_.clear();
    count_ = 0;
    has_more_ = false;
    next_at_ = first_at();
    walk();
  }

  template <class T>
  T number_at(std::uint64_t offset) const {
    char bytes[sizeof(T)];
    file_.read(offset, bytes);
    return load<T>(bytes, std::endian::little);
  }

  std::uint64_t first_at() const { return header_.points_at + 8; }
  bool is_variable() const { return laszip_.chunk_size == laszip_record::variable_chunks; }
  bool is_complete() const { return header_.count > 0 && count_ == header_.count; }
  // Where the number of points is not known, chunks go on to the table.
  std::uint64_t end() const { return header_.count == 0 && has_table() ? table_at_ : file_.size(); }

  bool has_table() const {
    return table_at_ >= first_at() && table_at_ <= file_.size() && file_.size() - table_at_ >= 8;
  }

  std::vector<table_entry> read_table() const;
  bool follow_table(const std::vector<table_entry>& table);
  void walk();
  bool add(std::uint64_t count, std::uint64_t size);
  bool has_more_in_last() const;
  std::optional<chunk> next_layered() const;

  const file_bytes& file_;
  const las_header& header_;
  const laszip_record& laszip_;
  const record_layout& layout_;
  std::uint64_t table_at_ = 0;
  std::uint64_t next_at_ = 0, count_ = 0;  // behind the chunks so far
  std::vector<chunk> chunks_;
  bool has_more_ = false;
};

// Adds a chunk behind the others; those behind the last point are left out. Returns whether it makes sense.
bool chunk_locator::add(std::uint64_t count, std::uint64_t size) {
  if (header_.count > 0) {
    has_more_ = has_more_ || (is_complete() && size > 0) || (is_variable() && count > header_.count - count_);
    count = std::min(count, header_.count - count_);
  }
  if (size > end() - next_at_ || count > size * max_points_per_byte) return false;
  if (count > 0) chunks_.push_back({next_at_, size, count_, count});
  next_at_ += size;
  count_ += count;
  return true;
}

std::vector<table_entry> chunk_locator::read_table() const {
  constexpr std::uint32_t known_version = 0;
  const std::uint32_t version = number_at<std::uint32_t>(table_at_);
  const std::uint64_t size = number_at<std::uint32_t>(table_at_ + 4);
  const std::uint64_t bytes_of_chunks = table_at_ - first_at(), bytes_of_table = file_.size() - table_at_ - 8;
  // Each chunk starts with a record that is not compressed.
  if (version != known_version || size > bytes_of_chunks / layout_.record_size()) return {};
  const std::uint64_t longest = 16 * size + 1024;
  const auto length = static_cast<std::size_t>(std::min(bytes_of_table, longest));
  std::string bytes(length + 4 * arithmetic_decoder::max_bytes, '\0');
  file_.read(table_at_ + 8, {bytes.data(), length});
  arithmetic_decoder in({bytes.data(), length});
  const auto numbers = std::make_unique_for_overwrite<integer_decoder<32, 2>>();
  numbers->reset();
  std::vector<table_entry> table(static_cast<std::size_t>(size));
  std::int32_t last_count = 0, last_size = 0;
  for (table_entry& entry : table) {
    if (is_variable()) last_count = numbers->decode(in, last_count, 0);
    last_size = numbers->decode(in, last_size, 1);
    entry = {is_variable() ? static_cast<std::uint32_t>(last_count) : laszip_.chunk_size,
             static_cast<std::uint32_t>(last_size)};
    if (in.is_overrun()) return {};
  }
  return table;
}

// Returns whether the table has all points.
bool chunk_locator::follow_table(const std::vector<table_entry>& table) {
  next_at_ = first_at();
  for (const table_entry& entry : table)
    if (entry.size > table_at_ - next_at_ || !add(entry.count, entry.size)) return false;
  // Only tables with counts, and layers, tell how many points there are if the header does not.
  return count_ == header_.count || (header_.count == 0 && is_variable());
}

// The chunk behind the others, by the sizes of its layers; none if the file ends before.
std::optional<chunk> chunk_locator::next_layered() const {
  const std::size_t header_size = layout_.header_size();
  if (end() - next_at_ < header_size) return std::nullopt;
  std::string bytes(header_size, '\0');
  file_.read(next_at_, bytes);
  const auto number = [&](std::size_t index) {
    return load<std::uint32_t>(bytes.data() + layout_.record_size() + 4 * index, std::endian::little);
  };
  std::uint64_t size = header_size;
  for (std::size_t i = 0; i < layout_.layers(); ++i) size += number(1 + i);
  if (size > end() - next_at_) return std::nullopt;
  return chunk{next_at_, size, count_, number(0)};
}

// Chunks in layers begin with a point and the number of points.
bool chunk_locator::has_more_in_last() const {
  if (!layout_.is_layered() || chunks_.empty()) return false;
  const chunk& last = chunks_.back();
  return number_at<std::uint32_t>(last.offset + layout_.record_size()) > last.count;
}

// Finds chunks from the first on.
void chunk_locator::walk() {
  if (layout_.is_layered()) {
    while (!is_complete()) {
      const std::optional<chunk> next = next_layered();
      if (!next || next->count == 0 || !add(next->count, next->size)) break;
    }
  } else if (is_variable()) {
    file_.fail("has lost the table of its compressed chunks", "Copy or export the scan again");
  } else {
    chunk_decoder decoder(file_, layout_);
    while (header_.count > count_) {
      const std::uint64_t count = std::min<std::uint64_t>(laszip_.chunk_size, header_.count - count_);
      if (!add(count, decoder.size_of(next_at_, count))) break;
    }
  }
  if (count_ < header_.count) file_.fail_truncated();
}

}  // namespace

located_chunks locate_chunks(const file_bytes& file, const las_header& header, const laszip_record& laszip,
                             const record_layout& layout) {
  return chunk_locator(file, header, laszip, layout).locate();
}

}  // namespace globalmatch::support::laz

#include "support/laz_chunk_writer.hpp"

#include <algorithm>
#include <random>
#include <sstream>
#include <string>

#include "catch.hpp"
#include "support/laz_chunk_decoder.hpp"
#include "written_scans.hpp"

namespace globalmatch::support::test_laz_chunk_writer {

namespace {

constexpr unsigned formats[] = {0, 1, 2, 3, 6, 7, 8};

laz::record_layout layout_of(unsigned format, std::size_t extra_bytes) {
  return {format, extra_bytes, 3};
}

std::string random_records(std::size_t size, std::size_t count, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::string records(size * count, '\0');
  for (char& byte : records) byte = static_cast<char>(random());
  return records;
}

// Records of which few values change, and those by little or to any other.
std::string similar_records(std::size_t size, std::size_t count, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::string records = random_records(size, 1, seed);
  for (std::size_t i = 1; i < count; ++i) {
    std::string record = records.substr(records.size() - size);
    for (char& byte : record)
      if (random() % 6 == 0)
        byte = static_cast<char>(random() % 3 == 0 ? random() : random() % 3 + unsigned(byte));
    records += record;
  }
  return records;
}

std::string decoded(const laz::record_layout& layout, const std::vector<char>& chunk, std::size_t count) {
  const temporary_directory directory;
  const file_bytes file(directory.file("chunk", {chunk.data(), chunk.size()}));
  std::string records(count * layout.record_size(), '\0');
  laz::chunk_decoder(file, layout).decode_records({0, chunk.size(), 0, count}, records);
  return records;
}

void check_chunk(const laz::record_layout& layout, laz::chunk_encoder& encoder, const std::string& records) {
  std::vector<char> chunk;
  encoder.encode(records, chunk);
  CHECK(decoded(layout, chunk, records.size() / layout.record_size()) == records);
}

std::string written(const laz::record_layout& layout, const std::string& records, int threads) {
  std::stringstream out;
  laz::chunk_writer writer(out, layout, threads);
  const std::size_t piece = 7001 * layout.record_size();
  for (std::size_t at = 0; at < records.size(); at += piece)
    writer.write(std::span(records).subspan(at, std::min(piece, records.size() - at)));
  writer.finish();
  return out.str();
}

}  // namespace

TEST_CASE("chunks are decoded to the records that they were encoded from") {
  for (const unsigned format : formats)
    for (const std::size_t extra_bytes : {0u, 3u}) {
      INFO("format " << format << ", extra bytes " << extra_bytes);
      const laz::record_layout layout = layout_of(format, extra_bytes);
      laz::chunk_encoder encoder(layout);
      for (const std::uint32_t count : {1u, 2u, 3u, 1500u}) {
        std::string records;
        for (std::uint32_t i = 0; i < count; ++i) records += made_record(format, extra_bytes, format >= 6, i);
        check_chunk(layout, encoder, records);
      }
    }
}

TEST_CASE("records of any bits are encoded, alike or not") {
  for (const unsigned format : formats)
    for (std::uint32_t seed = 1; seed <= 3; ++seed) {
      INFO("format " << format << ", seed " << seed);
      const laz::record_layout layout = layout_of(format, 2);
      laz::chunk_encoder encoder(layout);
      check_chunk(layout, encoder, random_records(layout.record_size(), 700, seed));
      check_chunk(layout, encoder, similar_records(layout.record_size(), 3000, seed));
      check_chunk(layout, encoder, std::string(500 * layout.record_size(), '\0'));
    }
}

TEST_CASE("what does not change in a chunk of layers takes no bytes") {
  const laz::record_layout layout = layout_of(8, 4);
  std::string records;
  for (int i = 0; i < 10'000; ++i) records += made_record(8, 4, false, 5);
  std::vector<char> chunk;
  laz::chunk_encoder(layout).encode(records, chunk);
  CHECK(chunk.size() < layout.header_size() + 400);
  CHECK(decoded(layout, chunk, 10'000) == records);
}

TEST_CASE("compressed bytes are the same for any number of threads") {
  for (const unsigned format : {1u, 7u}) {
    const laz::record_layout layout = layout_of(format, 1);
    const std::string records =
        similar_records(layout.record_size(), 2 * laz::chunk_writer::chunk_size + 123, 9);
    const std::string alone = written(layout, records, 1);
    CHECK(alone.size() < records.size());
    CHECK(written(layout, records, 2) == alone);
    CHECK(written(layout, records, 5) == alone);
  }
}

TEST_CASE("no points are an empty table of chunks") {
  const std::string bytes = written(layout_of(6, 0), "", 2);
  std::string expected;
  put(expected, std::int64_t(8));
  put(expected, std::uint64_t(0));
  CHECK(bytes == expected);
}

}  // namespace globalmatch::support::test_laz_chunk_writer

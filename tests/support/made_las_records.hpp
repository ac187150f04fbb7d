// Point records of all LAS formats without wave packets, made by formulas: what the files in
// tests/support/data hold, which laz-perf 2b68700 and LASzip ac3e9e9 compressed.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>

namespace globalmatch::support {

/// A number of 32 bits that looks random.
inline std::uint32_t mixed(std::uint32_t index, std::uint32_t salt) {
  std::uint32_t h = index * 0x9E3779B9u + salt * 0x85EBCA6Bu + 1;
  h = (h ^ h >> 16) * 0x7FEB352Du;
  h = (h ^ h >> 15) * 0x846CA68Bu;
  return h ^ h >> 16;
}

/// Little endian bytes behind each other.
struct record_writer {
  std::string bytes;

  void put(std::uint64_t value, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) bytes += static_cast<char>(value >> 8 * i & 0xFF);
  }
};

/// A pulse has one to three returns; times are of two interleaved sequences with some gaps, coordinates have
/// noise of different size and some jumps over the whole range.
struct made_point {
  std::uint32_t x, y, z, number, count;
  std::uint64_t time;

  explicit made_point(std::uint32_t i) {
    const std::uint32_t pulse = i / 3, noise = 1u << mixed(pulse / 16, 1) % 14;
    const bool jumps = mixed(i, 2) % 97 == 0;
    count = 1 + mixed(pulse, 3) % 3;
    number = 1 + i % 3 % count;
    x = 500'000'000 + 310 * pulse + mixed(i, 4) % noise + (jumps ? mixed(i, 5) : 0);
    y = 700'000'000 + 17 * pulse + mixed(i, 6) % noise + (jumps ? mixed(i, 7) : 0);
    z = 400'000 + 5'000 * (count - number) + mixed(i, 8) % (noise + 9) + (jumps ? mixed(i, 9) : 0);
    const double seconds = (pulse % 7 == 3 ? 9'000 : 300'000'000) + pulse * 1e-5 +
                           (mixed(pulse, 10) % 41 == 0 ? mixed(pulse, 11) : 0) * 1e-3;
    time = std::bit_cast<std::uint64_t>(seconds);
  }
};

/// The record of point number `i`. Four scanner channels take turns if `has_channels`.
inline std::string made_record(unsigned format, std::size_t extra_bytes, bool has_channels, std::uint32_t i) {
  constexpr std::uint32_t classes[] = {2, 2, 2, 5, 5, 7, 1, 18};
  const made_point p(i);
  const std::uint32_t class_number = classes[mixed(i / 5, 12) % 8], flags = mixed(i, 13) % 53 == 0 ? 4 : 0;
  const std::uint32_t line = i / 100, channel = has_channels ? mixed(i / 4, 14) % 4 : 0;
  record_writer record;
  for (const std::uint32_t coordinate : {p.x, p.y, p.z}) record.put(coordinate, 4);
  record.put(20'000 / p.count + mixed(i, 15) % 300, 2);
  if (format < 6) {
    record.put(p.number | p.count << 3 | (line & 1) << 6, 1);
    record.put(class_number | flags << 5, 1);
    record.put(mixed(line, 16) % 60, 1);
    record.put(mixed(i / 10, 17) % 4, 1);
  } else {
    record.put(p.number | p.count << 4, 1);
    record.put(flags | channel << 4 | (line & 1) << 6, 1);
    record.put(class_number, 1);
    record.put(mixed(i / 10, 17) % 4, 1);
    record.put(mixed(i / 7, 16) % 6000, 2);
  }
  record.put(11 + mixed(line, 18) % 3, 2);
  if (format == 1 || format == 3 || format >= 6) record.put(p.time, 8);
  if (format == 2 || format == 3 || format >= 7) {
    const std::uint32_t grey = mixed(i, 19) % 65536;
    for (std::uint32_t k = 0; k < 3; ++k)
      record.put(i % 11 == 0 ? grey : (60 + 20 * k + mixed(i, 20 + k) % 9) << 8 | (i % 13 == 0 ? k : 0), 2);
  }
  if (format == 8) record.put(30'000 + mixed(i, 23) % 700, 2);
  for (std::uint32_t k = 0; k < extra_bytes; ++k) record.put(k == 1 ? 5 : mixed(i / (k + 1), 24 + k) % 9, 1);
  return record.bytes;
}

}  // namespace globalmatch::support

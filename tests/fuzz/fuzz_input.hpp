// What the fuzzer's bytes stand for.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <vector>

namespace globalmatch::fuzz {

/// Ends the process, which the fuzzer takes for a find.
inline void require(bool holds, const char* claim) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", claim);
  std::abort();
}

/// Bytes, read from front to back; zeros after the end.
class byte_source {
 public:
  byte_source(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}

  bool empty() const { return left_ == 0; }

  template <class T>
  T take() {
    T value{};
    const std::size_t count = left_ < sizeof(T) ? left_ : sizeof(T);
    std::memcpy(&value, data_, count);
    data_ += count;
    left_ -= count;
    return value;
  }

  /// One of `count` choices.
  unsigned choice(unsigned count) { return take<std::uint8_t>() % count; }

  /// A coordinate: mostly centimetres of a plot, now and then what no scanner should write.
  double coordinate() {
    const auto raw = take<std::int16_t>();
    constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                     infinity = std::numeric_limits<double>::infinity();
    switch (raw) {
      case 0x7fff:
        return nan;
      case 0x7ffe:
        return infinity;
      case 0x7ffd:
        return -infinity;
      case 0x7ffc:
        return 1e9;
      case 0x7ffb:
        return -1e15;
      case 0x7ffa:
        return std::numeric_limits<double>::max();
      case 0x7ff9:
        return std::numeric_limits<double>::denorm_min();
      default:
        return raw / 100.0;
    }
  }

  Eigen::Vector3d position() {
    const double x = coordinate(), y = coordinate(), z = coordinate();
    return {x, y, z};
  }

  /// At most `max_count` positions, as many as the next byte says and the bytes are enough for.
  std::vector<Eigen::Vector3d> positions(std::size_t max_count) {
    std::vector<Eigen::Vector3d> all;
    for (std::size_t count = std::size_t(take<std::uint8_t>()) % (max_count + 1); count > 0 && !empty();
         --count)
      all.push_back(position());
    return all;
  }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

}  // namespace globalmatch::fuzz

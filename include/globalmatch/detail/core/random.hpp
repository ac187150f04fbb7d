// Random numbers that are the same everywhere: the standard distributions differ between libraries.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <stdexcept>

namespace globalmatch::detail {

/// A small random generator: splitmix64 (Steele, Lea, Flood 2014, "Fast splittable pseudorandom number
/// generators", OOPSLA). One seed has many independent streams, so that parallel work can own one for each
/// item, whatever thread it runs on. Stream 0 is the published sequence of the seed.
class random_source {
 public:
  explicit random_source(std::uint64_t seed, std::uint64_t stream = 0) : state_(seed + mix(stream)) {}

  /// 64 random bits.
  std::uint64_t next() { return mix(state_ += 0x9e3779b97f4a7c15u); }

  /// Uniform in [0, 1), in steps of 2^-53.
  double uniform() { return double(next() >> 11) * 0x1p-53; }

  /// Uniform in [0, n), without bias. Throws `std::invalid_argument` when `n` is 0.
  std::uint32_t below(std::uint32_t n) {
    if (n == 0) throw std::invalid_argument("random_source::below: n must be at least 1");
    const std::uint32_t incomplete = (0u - n) % n;  // 2^32 mod n products would favour some results
    for (;;) {
      const std::uint64_t product = (next() >> 32) * n;
      if (static_cast<std::uint32_t>(product) >= incomplete) return static_cast<std::uint32_t>(product >> 32);
    }
  }

  /// Gaussian with mean 0 and standard deviation 1 (Box-Muller).
  double normal() {
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }

 private:
  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }

  std::uint64_t state_;
};

}  // namespace globalmatch::detail

// Eight floats at a time, as plain loops that compilers turn into vector instructions.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace globalmatch::detail {

constexpr std::size_t lane_count = 8;
using float_lanes = std::array<float, lane_count>;

/// 1 where positive, else 0; without a branch.
inline float one_if_positive(float x) {
  const float scaled = x * 1e30f, positive = scaled > 0 ? scaled : 0;
  return positive < 1 ? positive : 1;
}

/// Square roots in place.
inline void take_square_roots(float* x, std::size_t count) {
  std::size_t k = 0;
#if defined(__SSE2__)
  for (; k + 4 <= count; k += 4) {
    const __m128 a = _mm_loadu_ps(x + k), half = _mm_mul_ps(a, _mm_set1_ps(-0.5f));
    const __m128 tiny = _mm_cmplt_ps(a, _mm_set1_ps(std::numeric_limits<float>::min()));
    __m128 r = _mm_rsqrt_ps(a);
    r = _mm_mul_ps(r, _mm_add_ps(_mm_mul_ps(half, _mm_mul_ps(r, r)), _mm_set1_ps(1.5f)));
    _mm_storeu_ps(x + k, _mm_andnot_ps(tiny, _mm_mul_ps(a, r)));
  }
#endif
  for (; k < count; ++k) x[k] = std::sqrt(x[k]);
}

/// Sum in the order of eight lanes, or of four, that are added up at the end.
inline float sum_in_lanes(const float* x, std::size_t count) {
  float sum = 0;
  std::size_t next = 0;
  if (count >= 4) {
    float lanes[4] = {x[0], x[1], x[2], x[3]};
    next = 4;
    if (count >= 8) {
      float upper[4] = {x[4], x[5], x[6], x[7]};
      for (next = 8; next + 8 <= count; next += 8)
        for (std::size_t k = 0; k < 4; ++k) lanes[k] += x[next + k], upper[k] += x[next + 4 + k];
      for (std::size_t k = 0; k < 4; ++k) lanes[k] += upper[k];
      if (next + 4 <= count) {
        for (std::size_t k = 0; k < 4; ++k) lanes[k] += x[next + k];
        next += 4;
      }
    }
    sum = (lanes[0] + lanes[2]) + (lanes[1] + lanes[3]);
  }
  for (; next < count; ++next) sum += x[next];
  return sum;
}

/// In doubles.
inline double sum_of(const float_lanes& x) {
  return ((double(x[0]) + double(x[1])) + (double(x[2]) + double(x[3]))) +
         ((double(x[4]) + double(x[5])) + (double(x[6]) + double(x[7])));
}

}  // namespace globalmatch::detail

#include "unit.hpp"

#include <globalmatch/execution.hpp>

#include <cmath>

unit_result UNIT::compute() {
  const globalmatch::execution how{.threads = 3, .on_progress = {}};
  const std::size_t count = 10000, chunk = 100;
  unit_result result{std::vector<double>(count / chunk), globalmatch::thread_count(how)};
  globalmatch::parallel_chunks(how, "sums", count, chunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) result.chunk_sums[begin / chunk] += std::sqrt(double(i));
  });
  return result;
}

// How many points of a scan have each return number and each class.
#pragma once

#include <array>
#include <cstddef>
#include <mutex>

#include "globalmatch/detail/core/threads.hpp"

namespace globalmatch::support {

/// Of the values that LAS has. Where a file does not have one of them, all its counts are 0.
struct class_counts {
  std::array<std::size_t, 16> return_numbers = {};  ///< from 1 on; 0 where no return is noted
  std::array<std::size_t, 16> return_counts = {};   ///< the number of returns of the pulse
  std::array<std::size_t, 256> classes = {};        ///< as LAS 1.4 numbers them: 2 ground, 5 high vegetation

  void add(unsigned return_number, unsigned return_count, unsigned class_number) {
    ++return_numbers[return_number];
    ++return_counts[return_count];
    ++classes[class_number];
  }

  class_counts& operator+=(const class_counts& other) {
    const auto add_to = [](auto& sums, const auto& counts) {
      for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += counts[i];
    };
    add_to(return_numbers, other.return_numbers);
    add_to(return_counts, other.return_counts);
    add_to(classes, other.classes);
    return *this;
  }

  bool operator==(const class_counts&) const = default;
};

/// The sum of what `count(begin, end, counts)` adds for chunks of [0, size), in parallel.
template <class Count>
class_counts count_in_chunks(const execution& exec, std::size_t size, std::size_t chunk, const Count& count) {
  class_counts sum;
  std::mutex mutex;
  detail::parallel_chunks(exec, "count classes", size, chunk, [&](std::size_t begin, std::size_t end) {
    class_counts here;
    count(begin, end, here);
    const std::scoped_lock lock(mutex);
    sum += here;
  });
  return sum;
}

}  // namespace globalmatch::support

// How well probabilities hold.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iostream>
#include <vector>

namespace globalmatch::benchmarks {

struct prediction {
  double probability = 0;
  bool is_right = false;
};

/// Prints, in bins of as many predictions each, how probable they were said to be and the share that is
/// right; then the expected calibration error and the Brier skill.
inline void print_calibration(std::vector<prediction> sorted) {
  constexpr std::size_t bins = 20;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const prediction& a, const prediction& b) { return a.probability < b.probability; });
  double brier = 0, right = 0, off = 0;
  std::size_t wrong_but_sure = 0;
  std::cout << "\n| pairs | mean probability | share that is right |\n|---|---|---|\n";
  for (std::size_t b = 0; b < bins; ++b) {
    const std::size_t begin = b * sorted.size() / bins, end = (b + 1) * sorted.size() / bins;
    if (begin == end) continue;  // there are fewer predictions than bins
    double said = 0, was = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const double p = sorted[i].probability, y = sorted[i].is_right;
      said += p;
      was += y;
      brier += (p - y) * (p - y);
      wrong_but_sure += p > 0.99 && !sorted[i].is_right;
    }
    right += was;
    off += std::abs(said - was);
    const double count = double(end - begin);
    std::cout << "| " << count << " | " << said / count << " | " << was / count << " |\n";
  }
  const double all = double(sorted.size()), share = right / all;
  std::cout << "\nexpected calibration error " << off / all << ", Brier skill "
            << 1 - brier / all / (share * (1 - share)) << ", wrong above 0.99: " << wrong_but_sure << "\n";
}

}  // namespace globalmatch::benchmarks

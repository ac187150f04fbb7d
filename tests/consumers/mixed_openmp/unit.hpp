#pragma once

#include <vector>

// What one translation unit computes; `unit.cpp` is compiled once for each of the two names.
struct unit_result {
  std::vector<double> chunk_sums;
  std::vector<double> transform;  // 16 numbers of a matched pair of stem maps; empty when not registered
  int threads;
};

namespace with_openmp {
unit_result compute();
}
namespace without_openmp {
unit_result compute();
}

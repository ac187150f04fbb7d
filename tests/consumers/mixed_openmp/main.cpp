// One program of two units, with and without OpenMP: each keeps its own threading, and the results are the
// same bits. Exit status 0: they are.
#include "unit.hpp"

int main() {
  const unit_result parallel = with_openmp::compute();
  const unit_result serial = without_openmp::compute();
  const bool own_threading = parallel.threads == 3 && serial.threads == 1;
  const bool same_sums = parallel.chunk_sums == serial.chunk_sums && serial.chunk_sums.back() > 0;
  const bool same_transform = parallel.transform == serial.transform && serial.transform.size() == 16;
  return own_threading && same_sums && same_transform ? 0 : 1;
}

// Must fail on: position
#include <globalmatch/points.hpp>

#include <vector>

int main() {
  return static_cast<int>(globalmatch::xyz(std::vector<double>{1, 2, 3})[0]);
}

// Must fail on: position
#include <globalmatch/points.hpp>

int main() {
  return static_cast<int>(globalmatch::xyz(3.5)[0]);
}

// Must fail on: point_range
#include <globalmatch/points.hpp>

#include <vector>

int main() {
  const std::vector<int> numbers(3);
  const std::vector<globalmatch::point_index> indices = {0};
  return static_cast<int>(globalmatch::subset_points(numbers, std::span(indices)).size());
}

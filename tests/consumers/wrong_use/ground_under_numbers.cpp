// Must fail on: point_range
#include <globalmatch/detail/mapping/ground.hpp>

#include <vector>

int main() {
  globalmatch::detail::model_ground(std::vector<int>(3));
}

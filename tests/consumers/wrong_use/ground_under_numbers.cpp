// Must fail on: point_range
#include <globalmatch/detail/mapping/ground.hpp>

#include <vector>

int main() {
  globalmatch::model_ground(std::vector<int>(3));
}

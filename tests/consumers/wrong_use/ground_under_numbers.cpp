// Must fail on: point_range
#include <globalmatch/ground.hpp>

#include <vector>

int main() {
  globalmatch::model_ground(std::vector<int>(3));
}

// Must fail on: position_range
#include <globalmatch/stem_matching.hpp>

#include <vector>

int main() {
  globalmatch::match_stems(std::vector<Eigen::Vector3d>(4), Eigen::Vector3d(1, 2, 3));
}

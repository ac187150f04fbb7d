// Must fail on: point_range
#include <globalmatch/stem_mapping.hpp>

#include <vector>

int main() {
  globalmatch::map_stems(std::vector<int>(3));
}

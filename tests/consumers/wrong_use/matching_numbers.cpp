// Must fail on: position_range
#include <globalmatch/stem_matching.hpp>

#include <vector>

int main() {
  globalmatch::match_stems(std::vector<double>(4), std::vector<double>(4));
}

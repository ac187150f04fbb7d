#include "globalmatch/detail/core/disjoint_sets.hpp"

#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_disjoint_sets {

using namespace detail;

TEST_CASE("joined sets have one representative, whichever was joined to which") {
  random_source random(23);
  for (int repetition = 0; repetition < 20; ++repetition) {
    constexpr point_index count = 60;
    disjoint_sets sets(count);
    std::vector<point_index> label(count);
    for (point_index i = 0; i < count; ++i) label[i] = i;
    for (int joins = 0; joins < 40; ++joins) {
      const point_index a = random.below(count), b = random.below(count);
      CHECK(sets.join(a, b) == (label[a] != label[b]));
      const point_index from = label[a], to = label[b];
      for (point_index& l : label)
        if (l == from) l = to;
    }
    for (point_index i = 0; i < count; ++i)
      for (point_index j = 0; j < count; ++j) CHECK((sets.find(i) == sets.find(j)) == (label[i] == label[j]));
  }
}

}  // namespace globalmatch::test_disjoint_sets

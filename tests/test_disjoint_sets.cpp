#include "globalmatch/detail/core/disjoint_sets.hpp"

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch {

using namespace detail;

TEST_CASE("numbers are in one set where a chain of joins connects them") {
  constexpr std::uint32_t count = 60;
  random_source random(1);
  disjoint_sets sets(count);
  std::vector<std::uint32_t> label(count);  // of each number: joined ones are relabelled, the slow way
  for (std::uint32_t i = 0; i < count; ++i) label[i] = i;
  for (int join = 0; join < 50; ++join) {
    const auto a = std::uint32_t(count * random.uniform()), b = std::uint32_t(count * random.uniform());
    CHECK(sets.join(a, b) == (label[a] != label[b]));
    const std::uint32_t from = label[a], to = label[b];
    for (std::uint32_t& l : label)
      if (l == from) l = to;
  }
  for (std::uint32_t i = 0; i < count; ++i)
    for (std::uint32_t k = 0; k < count; ++k) CHECK((sets.root(i) == sets.root(k)) == (label[i] == label[k]));
}

}  // namespace globalmatch

#include "globalmatch/detail/core/per_thread.hpp"

#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/threads.hpp"

namespace globalmatch::test_per_thread {

using namespace detail;

TEST_CASE("what threads gather is of all chunks, each once, in no more objects than threads") {
  constexpr std::size_t chunks = 5000;
  for (const int threads : {1, 2, 4}) {
    const execution exec{.threads = threads};
    const parallel_scope scope(exec, "test");
    per_thread<std::vector<std::size_t>> gathered;
    parallel_for(
        exec, "test", chunks,
        [&](std::size_t i) {
          auto own = gathered.take();
          own->push_back(i);
          gathered.give_back(std::move(own));
        },
        1);
    CHECK(gathered.all().size() <= std::size_t(threads));
    std::size_t sum = 0, count = 0;
    for (const auto& own : gathered.all()) {
      count += own->size();
      sum = std::accumulate(own->begin(), own->end(), sum);
    }
    CHECK(count == chunks);
    CHECK(sum == chunks * (chunks - 1) / 2);
  }
}

TEST_CASE("an object is made only where all others are lent") {
  per_thread<std::vector<int>> gathered;
  auto first = gathered.take(std::size_t(3), 7), second = gathered.take(std::size_t(1), 5);
  CHECK(*first == std::vector<int>{7, 7, 7});
  CHECK(*second == std::vector<int>{5});
  gathered.give_back(std::move(first));
  CHECK(gathered.take(std::size_t(9), 9)->size() == 3);
}

}  // namespace globalmatch::test_per_thread

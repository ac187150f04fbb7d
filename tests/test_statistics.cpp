#include "globalmatch/statistics.hpp"

#include <cmath>
#include <vector>

#include "catch.hpp"

namespace globalmatch {

TEST_CASE("the median is the middle value, or the mean of the two in the middle") {
  const auto of = [](std::vector<double> values) { return median(values); };
  CHECK(of({3}) == 3);
  CHECK(of({5, 1}) == 3);
  CHECK(of({9, 1, 2}) == 2);
  CHECK(of({4, 1, 9, 2}) == 3);
  CHECK(of({1, 1, 1, 7}) == 1);
  CHECK(std::isnan(of({})));
}

}  // namespace globalmatch

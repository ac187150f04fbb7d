#include "globalmatch/detail/core/robust.hpp"

#include "catch.hpp"

namespace globalmatch::detail::test_robust {

TEST_CASE("Tukey's weight is the square of what is left of 1, and nothing from the largest residual on") {
  CHECK(tukey_weight(0) == 1);
  CHECK(tukey_weight(0.25) == 0.5625);
  CHECK(tukey_weight(0.5) == 0.25);
  CHECK(tukey_weight(1) == 0);
  CHECK(tukey_weight(4) == 0);
}

}  // namespace globalmatch::detail::test_robust

#include "support/progress_bar.hpp"

#include <sstream>
#include <string>

#include "catch.hpp"

namespace globalmatch::support::test_progress_bar {

TEST_CASE("the bar shows the stage and its share, and is gone at the end") {
  std::ostringstream out;
  {
    progress_bar bar(out);
    bar.show({"verticality", 0.5});
    CHECK_THAT(out.str(), Catch::StartsWith("\r[===============               ] 50 % verticality"));
    bar.clear();
    CHECK_THAT(out.str(), Catch::EndsWith(" \r"));
    const auto length = out.str().size();
    bar.clear();
    CHECK(out.str().size() == length);
    bar.show({"clusters", 2});
  }
  CHECK_THAT(out.str(), Catch::Contains("[==============================] 100 % clusters"));
  CHECK_THAT(out.str(), Catch::EndsWith(" \r"));
}

}  // namespace globalmatch::support::test_progress_bar

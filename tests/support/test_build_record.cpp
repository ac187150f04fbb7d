#include "support/build_record.hpp"

#include "catch.hpp"
#include "support/file_error.hpp"

namespace globalmatch::support::test_build_record {

using Catch::Matchers::Contains;

TEST_CASE("a file of this build is taken, of another build or instruction set refused with both names") {
  const std::string own = this_build().name();
  CHECK(own.starts_with(this_build().version));
  CHECK_FALSE(this_build().compiler.empty());
  CHECK_NOTHROW(require_this_build("a.gmap", own, instruction_set()));
  CHECK_THROWS_WITH(require_this_build("a.gmap", "0.0", instruction_set()),
                    Contains("a.gmap") && Contains("0.0") && Contains(own));
  CHECK_THROWS_AS(require_this_build("a.gmap", own, "other"), file_error);
}

}  // namespace globalmatch::support::test_build_record

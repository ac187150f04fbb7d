#include "support/process_identity.hpp"

#include "catch.hpp"

namespace globalmatch::support::test_process_identity {

TEST_CASE("a process that runs, and one of another host, are not known to have ended") {
  const process_identity own = process_identity::own();
  CHECK(own.process > 0);
  CHECK(own == process_identity::own());
  CHECK_FALSE(has_ended(own));
  CHECK_FALSE(has_ended({own.host + ".elsewhere", 999'999'999}));
  CHECK_FALSE(has_ended({own.host, 0}));
}

}  // namespace globalmatch::support::test_process_identity

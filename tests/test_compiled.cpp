#include "globalmatch/detail/core/compiled.hpp"

#include <type_traits>

#include "catch.hpp"

namespace globalmatch::test_compiled {

using namespace detail;

TEST_CASE("functions of both modes, and of other alignments, have names of their own") {
  CHECK_FALSE(std::is_same_v<mode<16, true>, mode<16, false>>);
  CHECK_FALSE(std::is_same_v<mode<16, true>, mode<32, true>>);
#if defined(GLOBALMATCH_COMPILED)
  constexpr bool compiled = true;
#else
  constexpr bool compiled = false;
#endif
  CHECK(std::is_same_v<build_mode, mode<EIGEN_MAX_STATIC_ALIGN_BYTES, compiled>>);
}

}  // namespace globalmatch::test_compiled

#include "globalmatch/detail/core/little_endian.hpp"

#include <cstdint>
#include <limits>
#include <string>

#include "catch.hpp"

namespace globalmatch::test_little_endian {

using namespace detail;

namespace {

template <class T>
std::string bytes_of(T value) {
  std::string bytes(sizeof(T), 'x');
  store_little_endian(value, bytes.data());
  return bytes;
}

}  // namespace

TEST_CASE("the least significant byte of a number comes first") {
  CHECK(bytes_of(std::uint32_t(0x01020304)) == std::string("\4\3\2\1", 4));
  CHECK(bytes_of(std::int16_t(-2)) == "\xfe\xff");
  CHECK(bytes_of(1.0) == std::string("\0\0\0\0\0\0\xf0\x3f", 8));
  CHECK(bytes_of(-2.0f) == std::string("\0\0\0\xc0", 4));
}

TEMPLATE_TEST_CASE("numbers are read as they were written, from any place", "", char, std::int8_t,
                   std::uint16_t, std::int32_t, std::uint64_t, float, double) {
  using limits = std::numeric_limits<TestType>;
  for (const TestType value : {limits::lowest(), limits::max(), TestType(0), TestType(1), limits::min()}) {
    const std::string bytes = "?" + bytes_of(value);  // not aligned
    CHECK(load_little_endian<TestType>(bytes.data() + 1) == value);
  }
}

}  // namespace globalmatch::test_little_endian

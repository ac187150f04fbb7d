#include "globalmatch/detail/core/crc32c.hpp"

#include <string>

#include "catch.hpp"
#include "globalmatch/detail/core/little_endian.hpp"
#include "support/e57_checksums.hpp"

namespace globalmatch::detail::test_crc32c {

TEST_CASE("the checksum is CRC-32C, whatever the number of bytes") {
  CHECK(crc32c(std::string("123456789")) == 0xE3069283);  // the check value of the catalogue of CRCs
  CHECK(crc32c(std::string(32, '\0')) == 0x8A9136AA);     // RFC 3720, B.4
  std::string bytes;
  for (int i = 0; i < 100; ++i) {
    CHECK(crc32c(bytes) == support::slow_crc32c(bytes));
    bytes.push_back(static_cast<char>(37 * i));
  }
}

TEST_CASE("numbers are stored with their least significant byte first, and loaded with the same bits") {
  char bytes[8];
  store_little_endian(std::uint32_t(0x01020304), bytes);
  CHECK(std::string(bytes, 4) == "\4\3\2\1");
  CHECK(load_little_endian<std::uint32_t>(bytes) == 0x01020304);
  store_little_endian(1.0f, bytes);  // 0x3F800000
  CHECK(std::string(bytes, 4) == std::string("\0\0\x80\x3F", 4));
  for (const double value : {0.0, -0.0, 1.0 / 3, -1e300, 5e-324}) {
    store_little_endian(value, bytes);
    CHECK(std::bit_cast<std::uint64_t>(load_little_endian<double>(bytes)) ==
          std::bit_cast<std::uint64_t>(value));
  }
}

}  // namespace globalmatch::detail::test_crc32c

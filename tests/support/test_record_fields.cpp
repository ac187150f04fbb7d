#include "support/record_fields.hpp"

#include <cmath>
#include <limits>
#include <numeric>

#include "catch.hpp"
#include "file_checks.hpp"

namespace globalmatch::support::test_record_fields {

namespace {

// One number of type double, put into a field and taken out again.
double stored(double value, const record_field& field, char before = 0) {
  const std::size_t kept[] = {0};
  std::string record(16, before);
  std::string number;
  put(number, value, std::endian::native);
  put_numbers(number, {"a", scalar::float64}, kept, field, record.size(), record.data());
  std::vector<char> numbers;
  gather({record.data(), record.size(), 1}, field, numbers);
  return load(field.what.type, numbers.data(), std::endian::native);
}

}  // namespace

TEST_CASE("values are rounded and clamped to what a field can store") {
  CHECK(stored(7.5, {{"a", scalar::uint8}, 3}) == 8);
  CHECK(stored(-1, {{"a", scalar::uint16}, 3}) == 0);
  CHECK(stored(1e9, {{"a", scalar::int16}, 3}) == 32767);
  CHECK(stored(9, {{"a", scalar::uint8}, 3, 3, 3}) == 7);
  CHECK(stored(5, {{"a", scalar::uint8}, 3, 3, 3}, '\xFF') == 5);
  CHECK(stored(std::nan(""), {{"a", scalar::int32}, 3}) == 0);
  CHECK(stored(1e300, {{"a", scalar::int64}, 3}) ==
        static_cast<double>(std::numeric_limits<std::int64_t>::max()));
  CHECK(stored(1e300, {{"a", scalar::uint64}, 3}) ==
        static_cast<double>(std::numeric_limits<std::uint64_t>::max()));
  CHECK(stored(0.25, {{"a", scalar::float32}, 3}) == 0.25);
  CHECK(stored(30, {{"a", scalar::int16, 0.006}, 3}) == 5000);
}

TEST_CASE("fields of some bits leave the others as they are") {
  const std::size_t kept[] = {1, 2};
  std::string records = {'\xFF', '\x00'};
  put_numbers("\x01\x02\x05", {"a", scalar::uint8}, kept, {{"a", scalar::uint8}, 0, 2, 3}, 1, records.data());
  CHECK(records == std::string{'\xEB', '\x14'});
}

TEST_CASE("numbers of one type keep their bits") {
  const std::uint64_t odd[] = {0x7FF8'0000'DEAD'BEEF, 0x8000'0000'0000'0000, 1};
  std::string numbers;
  for (const std::uint64_t bits : odd) put(numbers, bits, std::endian::native);
  const std::size_t kept[] = {0, 1, 2};
  std::string records(3 * 11, 'x');
  const record_field field{{"t", scalar::float64}, 2};
  put_numbers(numbers, field.what, kept, field, 11, records.data());
  std::vector<char> read;
  gather({records.data(), 11, 3}, field, read);
  CHECK(std::string(read.begin(), read.end()) == numbers);
  CHECK(records[0] == 'x');
  CHECK(records[10] == 'x');
}

TEST_CASE("names of other programs are those of LAS") {
  CHECK(common_name("GpsTime") == "gps_time");
  CHECK(common_name("scalar_Scan_Angle_Rank") == "scan_angle");
  CHECK(common_name("colorRed") == "red");
  CHECK(common_name("Number Of Returns") == "number_of_returns");
  CHECK(common_name("my value") == "my_value");
  CHECK(common_name("") == "unnamed");
}

TEST_CASE("one type holds all values of another, or it does not") {
  CHECK(holds_all_of(scalar::int16, scalar::uint8));
  CHECK_FALSE(holds_all_of(scalar::uint16, scalar::int8));
  CHECK(holds_all_of(scalar::float32, scalar::uint16));
  CHECK_FALSE(holds_all_of(scalar::float32, scalar::int32));
  CHECK_FALSE(holds_all_of(scalar::int64, scalar::float32));
}

}  // namespace globalmatch::support::test_record_fields

#include "support/las_fields.hpp"

#include <set>

#include "catch.hpp"
#include "file_checks.hpp"
#include "support/las_header.hpp"

namespace globalmatch::support::test_las_fields {

TEST_CASE("fields of each point format are in its record and have names of their own") {
  for (unsigned format = 0; format <= 10; ++format) {
    std::set<std::string> names;
    for (const record_field& field : las_fields(format)) {
      INFO("format " << format << ", " << field.what.name);
      CHECK(names.insert(field.what.name).second);
      CHECK(common_name(field.what.name) == field.what.name);
      CHECK(field.offset + size_of(field.what.type) <= las_format_size(format));
    }
    CHECK(names.count("gps_time") == (format != 0 && format != 2));
    CHECK(names.count("red") ==
          (format == 2 || format == 3 || format == 5 || format == 7 || format == 8 || format == 10));
  }
  CHECK(las_fields(11).empty());
}

TEST_CASE("what describes extra bytes is read as it was written") {
  const std::vector<record_field> fields = {{{"height above ground", scalar::float32}, 34},
                                            {{"echo width", scalar::uint16, 0.1, -3}, 38},
                                            {{"number", scalar::int64}, 40}};
  const std::string description = describe_extra_fields(fields);
  REQUIRE(description.size() == 3 * extra_description_size);
  const auto read = extra_fields(description, 34, 48);
  REQUIRE(read.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(read[i].what == fields[i].what);
    CHECK(read[i].offset == fields[i].offset);
  }
}

TEST_CASE("extra bytes that nothing describes are attributes of a byte each") {
  const auto read = extra_fields("", 20, 22);
  REQUIRE(read.size() == 2);
  CHECK(read[1].what == attribute{"extra_bytes[1]", scalar::uint8});
  CHECK(read[1].offset == 21);
}

TEST_CASE("descriptions beyond the record are left out, and arrays become their numbers") {
  std::string description =
      describe_extra_fields({{{"vector", scalar::int16}, 0}, {{"far", scalar::float64}, 0}});
  description[2] = 24;  // three numbers of int16
  const auto read = extra_fields(description, 20, 29);
  REQUIRE(read.size() == 6);
  CHECK(read[2].what == attribute{"vector[2]", scalar::int16});
  CHECK(read[2].offset == 24);
  CHECK(read[3].what == attribute{"extra_bytes[0]", scalar::uint8});
  CHECK(extra_fields(std::string(10 * extra_description_size, '\xFF'), 20, 20).empty());
}

}  // namespace globalmatch::support::test_las_fields

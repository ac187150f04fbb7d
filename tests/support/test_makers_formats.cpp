#include "support/makers_formats.hpp"

#include "catch.hpp"

namespace globalmatch::support::test_makers_formats {

using namespace std::string_view_literals;
using Catch::Matchers::Contains;

TEST_CASE("makers' formats are recognised by content, whatever the name") {
  const auto require = [](std::string_view start, const std::string& name, const std::string& program) {
    const auto format = recognise_makers_format(start, "scan.bin");
    REQUIRE(format);
    CHECK_THAT(format->problem, Contains(name));
    CHECK_THAT(format->remedy, Contains(program));
  };
  require("RIEGL LMS RDB 2 POINTCLOUD FILE\0\1"sv, "RIEGL RDB 2", "RiSCAN PRO");
  require("PTG\0\xC7\xA3\x8F\x92"sv, "Leica PTG", "Cyclone");
  require("CCB2\x2F\0\0\0"sv, "CloudCompare", "CloudCompare and save");
}

TEST_CASE("makers' formats are recognised by extension where content does not tell") {
  const auto binary = "\1\2\3\0"sv;
  for (const auto& [name, program] : {std::pair{"scan.rxp", "RiSCAN PRO"},
                                      {"SCAN.FLS", "FARO SCENE"},
                                      {"a/b.zfs", "LaserControl"},
                                      {"a.lgs", "Cyclone"},
                                      {"a.imp", "Cyclone"},
                                      {"a.tzf", "RealWorks"},
                                      {"a.rcs", "ReCap"}}) {
    const auto format = recognise_makers_format(binary, name);
    INFO(name);
    REQUIRE(format);
    CHECK_THAT(format->remedy, Contains(program) && Contains("Export each") && Contains("E57"));
  }
}

TEST_CASE("text, and binary files of other names, are no makers' formats") {
  CHECK_FALSE(recognise_makers_format("1 2 3\n4 5 6\n", "scan.fls"));
  CHECK_FALSE(recognise_makers_format("CCB 1 2 3\n", "scan.bin"));
  CHECK_FALSE(recognise_makers_format("\1\2\3\0"sv, "scan.bin"));
  CHECK_FALSE(recognise_makers_format("\1\2\3\0"sv, "scan"));
}

}  // namespace globalmatch::support::test_makers_formats

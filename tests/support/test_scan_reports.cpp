#include "support/programs/scan_reports.hpp"

#include "catch.hpp"
#include "support/class_counts.hpp"

namespace globalmatch::support::test_scan_reports {

TEST_CASE("what is not known of a scan is null in its report") {
  const auto report = describe({.format = "text"}, {});
  CHECK(report["points"] == 0);
  for (const char* key : {"extent", "returns", "returns_of_pulse", "classes", "survey_from_file"})
    CHECK(report[key].is_null());
  CHECK(one_line({.format = "text"}, {}).find("returns") == std::string::npos);
}

TEST_CASE("returns and classes are reported by number, and in shares on the line") {
  scan_summary summary;
  summary.classes.emplace();
  for (int i = 0; i < 1000; ++i) summary.classes->add(i < 800 ? 1 : 2, 2, i == 0 ? 7 : 2);
  const auto report = describe({}, summary);
  CHECK(report["returns"] == nlohmann::ordered_json({{"1", 800}, {"2", 200}}));
  CHECK(report["returns_of_pulse"] == nlohmann::ordered_json({{"2", 1000}}));
  CHECK(report["classes"] == nlohmann::ordered_json({{"2", 999}, {"7", 1}}));
  const std::string line = one_line({}, summary);
  CHECK_THAT(line, Catch::Matchers::Contains(", returns 1: 80 %, 2: 20 %, classes 2: 100 %, 7: < 1 %"));
}

TEST_CASE("of many classes the line names the first ones, and the report all") {
  scan_summary summary;
  summary.classes.emplace();
  for (unsigned c = 0; c < 256; ++c) summary.classes->add(1, 1, c);
  CHECK_THAT(one_line({}, summary), Catch::Matchers::Contains("5: < 1 % and 250 more"));
  CHECK(describe({}, summary)["classes"].size() == 256);
}

}  // namespace globalmatch::support::test_scan_reports

#include "support/programs/run_record.hpp"

#include "catch.hpp"

namespace globalmatch::support::test_run_record {

TEST_CASE("a run records the options that it used, also those that were not given") {
  CLI::App app("what it does", "program");
  int count = 3;
  std::vector<std::string> names;
  std::string absent;
  app.add_option("--count", count)->capture_default_str();
  app.add_option("NAME", names);
  app.add_option("--absent", absent);
  app.parse("one two", false);
  stage_clock clock;
  const auto record = describe_run(app, {"program", "one", "two"}, clock);
  CHECK(record["options"]["count"] == "3");
  CHECK(record["options"]["NAME"] == std::vector<std::string>{"one", "two"});
  CHECK(record["options"]["absent"].is_null());
  CHECK_FALSE(record["options"].contains("help"));
  CHECK(record["command"].size() == 3);
  CHECK(record["seconds"].get<double>() >= 0);
  CHECK(record["stages"].empty());
  CHECK(record["globalmatch"]["version"].is_string());
}

}  // namespace globalmatch::support::test_run_record

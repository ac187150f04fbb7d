#include "support/programs/run_record.hpp"

#include <filesystem>
#include <string>
#include <vector>

#include "catch.hpp"
#include "support/content_hash.hpp"
#include "temporary_directory.hpp"

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

TEST_CASE(
    "files are recorded with bytes and hash, folders whole, and what cannot be read again with neither") {
  const temporary_directory directory;
  const auto file = directory.file("a.txt", "1 2 3\n");
  std::filesystem::create_directory(directory / "tiles");
  directory.file("tiles/1.txt", "1 2 3\n");
  directory.file("tiles/2.txt", "4 5 6 7\n");
  const auto record =
      describe_files({file, directory / "tiles", "-", directory / "absent", file.string() + "#1"});
  REQUIRE(record.size() == 5);
  CHECK(record[0]["path"] == file.string());
  CHECK(record[0]["bytes"] == 6);
  CHECK(record[0]["hash"] == content_hash(file));
  CHECK(record[1]["bytes"] == 14);
  CHECK(record[1]["hash"] == content_hash(directory / "tiles"));
  for (const std::size_t missing : {2u, 3u}) {
    CHECK(record[missing]["bytes"].is_null());
    CHECK(record[missing]["hash"].is_null());
  }
  CHECK(record[4]["hash"] == record[0]["hash"]);
}

}  // namespace globalmatch::support::test_run_record

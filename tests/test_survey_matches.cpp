#include "globalmatch/survey_matches.hpp"

#include <sstream>
#include <stdexcept>
#include <string>

#include "catch.hpp"

namespace globalmatch::test_survey_matches {

namespace {

survey_matches some_matches() {
  survey_matches matches;
  matches.fingerprint = 0x0123456789abcdefu;
  matches.maps = {1, 3, 5};
  matches.links = {"some", std::string("\0\xff\n", 3), ""};
  matches.provenance = {"of maps", "1.2", "64 bits"};
  return matches;
}

std::string written(const survey_matches& matches) {
  std::ostringstream out;
  write_survey_matches(out, matches);
  return out.str();
}

survey_matches read(const std::string& bytes) {
  std::istringstream in(bytes);
  return read_survey_matches(in);
}

}  // namespace

TEST_CASE("matches of a survey are read back as they were written, and nothing behind them") {
  const survey_matches matches = some_matches();
  std::istringstream in(written(matches) + "more");
  const survey_matches read_back = read_survey_matches(in);
  CHECK(read_back.fingerprint == matches.fingerprint);
  CHECK(read_back.maps == matches.maps);
  CHECK(read_back.links == matches.links);
  CHECK(read_back.provenance == matches.provenance);
  CHECK_FALSE(read_back.cancelled);
  std::string rest;
  in >> rest;
  CHECK(rest == "more");
  CHECK(written(read_back) == written(matches));
}

TEST_CASE("a file of matches that is damaged anywhere, or cut off, is refused") {
  const std::string bytes = written(some_matches());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] = char(damaged[i] ^ 0x10);
    CHECK_THROWS_AS(read(damaged), std::runtime_error);
    CHECK_THROWS_AS(read(bytes.substr(0, i)), std::runtime_error);
  }
  survey_matches uneven = some_matches();
  uneven.maps.pop_back();
  CHECK_THROWS_WITH(read(written(uneven)), Catch::Contains("links of each map"));
}

}  // namespace globalmatch::test_survey_matches

// --report of the programs: pages for each outcome, and names that are none.
#include <filesystem>
#include <string>

#include "catch.hpp"
#include "programs/program_run.hpp"
#include "programs/written_surveys.hpp"

namespace globalmatch::support::test_report_programs {

using Catch::Matchers::Contains;

TEST_CASE("a report of another name is refused before any work, with status 2") {
  const temporary_directory directory;
  write_three(directory);
  const run survey = call(directory, "register_survey",
                          "--stem-maps s1.csv s2.csv s3.csv --out-dir out --report report.pdf");
  CHECK(survey.status == 2);
  CHECK_THAT(survey.complaint, Contains("--report report.pdf") && Contains(".html"));
  CHECK_FALSE(std::filesystem::exists(directory / "out"));
  const run pair = call(directory, "register_scans", "absent.ply absent.ply --out T.txt --report report");
  CHECK(pair.status == 2);
  CHECK_THAT(pair.complaint, Contains("--report report"));
}

TEST_CASE("the page of a survey of stem maps names what was placed, and what was not with its reason") {
  const temporary_directory directory;
  write_three(directory);
  write_seen(directory / "a<b>.csv", stand(2), pose_at(30, 30, 1), 5);
  const run placed = call(directory, "register_survey",
                          "--stem-maps s1.csv s2.csv s3.csv 'a<b>.csv' --out-dir out --report report.html");
  CHECK(placed.status == 1);
  const std::string page = bytes_of(directory / "report.html");
  CHECK_THAT(page, Contains("<section class=\"trust partial\"") && Contains("3 of 4 scans are placed") &&
                       Contains("a&lt;b&gt;, because") && !Contains("<b>") && Contains("<svg") &&
                       Contains("stem maps alone hold no points"));
  CHECK_THAT(page, Contains("a&lt;b&gt;</th><td>placed alone</td>") &&
                       Contains("a&lt;b&gt;: placed alone in component 2") && !Contains("placed_alone") &&
                       !Contains("component 0"));
  CHECK_THAT(page, Contains("<td>the reference</td>") &&
                       Contains("standard errors against the reference, s") &&
                       Contains("<h2 id=\"poses_heading\">"));
  REQUIRE(call(directory, "register_survey",
               "--stem-maps s1.csv s2.csv s3.csv --out-dir out --report report.html")
              .status == 0);
  CHECK_THAT(bytes_of(directory / "report.html"),
             Contains("<section class=\"trust full\"") && Contains("All 3 scans are placed"));
}

TEST_CASE("scans without stems have a page as well, and the status that they had") {
  const temporary_directory directory;
  directory.file("flat.txt", [] {
    std::string points;
    for (int x = 0; x < 40; ++x)
      for (int y = 0; y < 40; ++y) points += std::to_string(0.5 * x) + " " + std::to_string(0.5 * y) + " 0\n";
    return points;
  }());
  const run failed =
      call(directory, "register_scans", "flat.txt flat.txt --out T.txt --report report.html --json r.json");
  CHECK(failed.status == 1);
  CHECK_THAT(bytes_of(directory / "report.html"),
             Contains("<section class=\"trust none\"") && Contains("no stems") && Contains("</html>"));
  CHECK_THAT(bytes_of(directory / "r.json"), Contains("\"command\"") && Contains("\"version\""));
}

}  // namespace globalmatch::support::test_report_programs

#include "support/report/registration_report.hpp"

#include <globalmatch/registration.hpp>

#include <algorithm>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "catch.hpp"
#include "file_checks.hpp"
#include "made_up_maps.hpp"
#include "support/programs/reports.hpp"
#include "support/programs/run_record.hpp"
#include "support/report/html_page.hpp"
#include "support/report/html_parts.hpp"
#include "support/report/report_file.hpp"
#include "support/report/residuals.hpp"
#include "support/report/section_picture.hpp"
#include "support/report/trust.hpp"

namespace globalmatch::support::test_registration_report {

using Catch::Matchers::Contains;
using detail::random_source;

namespace {

/// Ground at height 0 under a stand, however its stems were moved.
void add_ground(stem_map& map) {
  map.terrain.frame.origin = {-60, -60, 0};
  map.terrain.resolution = 1;
  map.terrain.columns = map.terrain.rows = 120;
  map.terrain.heights.assign(120 * 120, 0.0f);
  map.terrain.has_data.assign(120 * 120, 1);
}

struct made_pair {
  stem_map source, target;
  registration result;

  explicit made_pair(std::uint64_t seed, bool related = true) {
    random_source random(seed);
    scenes::two_maps_of_a_stand stand(random);
    source = stand.source;
    target = related ? stand.target : scenes::two_maps_of_a_stand(random).target;
    for (stem& s : target.stems) s.position += 0.01 * Eigen::Vector3d(random.normal(), random.normal(), 0);
    for (stem_map* map : {&source, &target}) {
      add_ground(*map);
      map->funnel.ground.points = 1234567;
      map->funnel.ground.cells = 1000;
      map->funnel.stems = map->stems.size();
    }
    result = register_maps(source, target);
  }

  scan_file scan_of(const stem_map& map) const {
    return scan_file({std::make_unique<points_in_memory>(map.stem_samples)});
  }

  nlohmann::ordered_json report() const {
    CLI::App app("what it does", "program");
    std::string given = "</script><script>alert(1)</script>";
    app.add_option("--text", given)->capture_default_str();
    stage_clock clock;
    nlohmann::ordered_json json = describe(result.matching, result.target_from_source);
    json["source"] = describe(source);
    json["target"] = describe(target);
    for (const char* of : {"source", "target"}) json[of]["warnings"] = nlohmann::ordered_json::array();
    json.update(describe_run(app, {"program", given}, clock));
    return json;
  }

  std::string page(const std::string& name = "b.ply", bool needs_height = false) const {
    const temporary_directory directory;
    const scan_file source_scan = scan_of(source), target_scan = scan_of(target);
    write_registration_report(directory / "report.html", {"a.ply", source_scan, source},
                              {name, target_scan, target}, result, needs_height, report());
    CHECK(directory.count_files() == 1);
    return bytes_of(directory / "report.html");
  }
};

/// Several transforms of a stand, none of which is the result.
made_pair ambiguous_pair() {
  made_pair pair(3);
  registration& r = pair.result;
  r.outcome = r.matching.outcome = outcome::ambiguous;
  r.reason = r.matching.reason = "two do as well";
  r.target_from_source.reset();
  r.matching.target_from_source.reset();
  r.matching.uncertainty.reset();
  r.matching.vertical.reset();
  r.matching.probability = 0.48;
  r.matching.hypotheses.resize(1);
  r.matching.hypotheses.push_back(r.matching.hypotheses.front());
  r.matching.hypotheses.back().target_from_source.translation().x() += 3;
  return pair;
}

std::size_t count(const std::string& text, std::string_view part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

}  // namespace

TEST_CASE("a good registration is trusted, with the numbers of the JSON") {
  const made_pair pair(1);
  REQUIRE(pair.result.outcome == outcome::registered);
  const std::string page = pair.page();
  const auto report = pair.report();
  CHECK_THAT(page, Contains("<section class=\"trust full\"") && Contains("the result can be trusted") &&
                       Contains("<title>&#10003; Registration of a.ply on b.ply</title>"));
  CHECK_THAT(page, Contains(counted(report["matches"].get<std::size_t>()) + " of " +
                            counted(report["source"]["stems"].get<std::size_t>()) + " and "));
  CHECK_THAT(page, Contains(as_percentage(report["probability"].get<double>())));
  CHECK_THAT(page, Contains(counted(1234567)));
  REQUIRE(report["hypotheses"].size() == 1);
  CHECK_THAT(page, Contains("There is no other that the stems speak for") && !Contains("Other hypotheses"));
  CHECK_THAT(page, Contains("<code>min_quality</code>") && !Contains("`"));
  for (const auto& number : report["target_from_source"]) CHECK_THAT(page, Contains(number.dump()));
  const auto& u = *pair.result.matching.uncertainty;
  CHECK_THAT(page, Contains(as_length(horizontal_error(u, u.center))));
}

TEST_CASE("an ambiguous registration is not trusted, and its hypotheses are compared without a script") {
  const std::string page = ambiguous_pair().page();
  CHECK_THAT(page, Contains("<section class=\"trust none\"") && Contains("<title>&#10007; ") &&
                       Contains("Ambiguous: do not use it") && Contains("two do as well") &&
                       Contains("48.0 %") && Contains("Probability that the best hypothesis is right"));
  CHECK(count(page, "type=\"radio\" name=\"shown\"") == 2);
  CHECK_THAT(page, Contains("Hypothesis 2") && !Contains("Result:") && !Contains("There is no other"));
}

TEST_CASE("a failed registration has its reason on top, and no points that nothing places") {
  const made_pair pair(4, false);
  REQUIRE(pair.result.outcome == outcome::not_registered);
  const std::string page = pair.page();
  CHECK_THAT(page, Contains("<section class=\"trust none\"") && Contains("there is no result to use") &&
                       Contains(prose_cell(pair.result.reason).markup) && !Contains("<script"));
  CHECK(page.find(prose_cell(pair.result.reason).markup) < page.find("<nav"));
}

TEST_CASE("maps without stems are reported, too") {
  made_pair pair(5);
  pair.source.stems.clear();
  pair.result = register_maps(pair.source, pair.target);
  CHECK_THAT(pair.page(), Contains("trust none") && Contains("No transform was found that pairs stems"));
}

TEST_CASE("a height that is not known limits the trust, and ends it where it is required") {
  made_pair pair(6);
  REQUIRE(pair.result.matching.vertical);
  pair.result.matching.vertical->source = vertical_source::none;
  pair.result.matching.vertical->reason = "no ground in common";
  CHECK(trust_in(pair.result, false).level == trust_level::partial);
  CHECK(trust_in(pair.result, true).level == trust_level::none);
  CHECK_THAT(pair.page(), Contains("trust the position, not the height") && Contains("no ground in common"));
}

TEST_CASE("names between backticks are code, and single backticks are kept") {
  CHECK(prose_cell("is `up` right, `a<b` too?").markup ==
        "is <code>up</code> right, <code>a&lt;b</code> too?");
  CHECK(prose_cell("a ` alone").markup == "a ` alone");
  CHECK(prose_cell("").markup.empty());
}

TEST_CASE("names and options are escaped wherever they stand") {
  const std::string page = made_pair(1).page("</title><script>alert(1)</script>\".ply");
  CHECK(count(page, "alert(1)") > 2);
  CHECK(count(page, "<script>alert") == 0);
  CHECK(count(page, "</title>") == 1 + count(page, "<svg"));
}

TEST_CASE("a page has its pictures and numbers in itself, and asks for nothing else") {
  const std::string page = made_pair(1).page();
  CHECK(count(page, "<svg") >= 3);
  CHECK(count(page, "<svg") == count(page, "</svg>"));
  CHECK_THAT(page, Contains("default-src 'none'") && !Contains(" src=") && !Contains("<link") &&
                       !Contains("@import") && !Contains("url("));
  const std::string before_script = page.substr(0, page.find("<script"));
  CHECK_THAT(before_script, Contains("</main>") && !Contains("nan") && !Contains("inf\""));
  CHECK_THAT(page, Contains("needs JavaScript") ||
                       Contains("<code>cmake -S . -B build/release -DGLOBALMATCH_REPORT_3D=ON</code>"));
}

TEST_CASE("the view has points of both scans where this build has one, and stays small") {
  const made_pair pair(1);
  const std::string page = pair.page();
  CHECK(page.size() < 15000000);
  CHECK((page.find("id=\"view_data\"") != std::string::npos) == has_view_3d());
}

TEST_CASE("residuals are those of the transform, and one that is far off leaves its ellipse") {
  made_pair pair(7);
  const auto shown = transforms_to_show(pair.result).front();
  pair.target.stems[shown.matches[3].second].position.x() += 0.2;
  const upright_map source(pair.source), target(pair.target);
  const auto residuals = residuals_of(source, target, shown, pair.result.matching.uncertainty);
  REQUIRE(residuals.size() == shown.matches.size());
  CHECK(residuals[3].share > 1);
  CHECK(residuals[3].residual.head<2>().norm() > 0.15);
  std::size_t outside = 0;
  for (const stem_residual& r : residuals) outside += r.share > 1;
  CHECK(outside < residuals.size() / 4);
  CHECK(residuals_of(source, target, {}, std::nullopt).empty());
}

TEST_CASE("a section runs through matched stems, in its own frame") {
  const made_pair pair(8);
  const auto shown = transforms_to_show(pair.result).front();
  const upright_map target(pair.target);
  const auto section = section_through(target, shown);
  REQUIRE(section);
  std::size_t along = 0;
  for (const auto& [s, t] : shown.matches) {
    const Eigen::Vector3d p = section->section_from_scan * target.positions[t];
    along += p.x() >= 0 && p.x() <= section->length && std::abs(p.y()) <= section->half_width;
  }
  CHECK(along >= 2);
  CHECK_FALSE(section_through(target, {"none", std::nullopt, {}}));
}

TEST_CASE("scans of one name are told apart by their folders") {
  CHECK(names_apart("x/a.ply", "y/b.ply") == std::pair<std::string, std::string>("a.ply", "b.ply"));
  CHECK(names_apart("w/x/a.ply", "y/a.ply") == std::pair<std::string, std::string>("x/a.ply", "y/a.ply"));
  CHECK(names_apart("a.ply", "y/a.ply") == std::pair<std::string, std::string>("a.ply", "y/a.ply"));
}

TEST_CASE("the name of a report is that of a drawing or of a page") {
  CHECK(report_format_of("a.svg") == report_format::svg);
  CHECK(report_format_of("b/a.html") == report_format::html);
  CHECK_NOTHROW(require_report_format(""));
  for (const char* name : {"a", "a.pdf", "a.htm", "svg", ".html", "a.html.txt"})
    CHECK_THROWS_WITH(require_report_format(name), Contains("name it so"));
}

TEST_CASE("a report that cannot be written is an error, and leaves nothing") {
  const temporary_directory directory;
  const made_pair pair(1);
  const scan_file scan = pair.scan_of(pair.source);
  CHECK_THROWS_AS(write_registration_report(directory / "absent/report.html", {"a", scan, pair.source},
                                            {"b", scan, pair.target}, pair.result, false, pair.report()),
                  file_error);
  CHECK(directory.count_files() == 0);
}

}  // namespace globalmatch::support::test_registration_report

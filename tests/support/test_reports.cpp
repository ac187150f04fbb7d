#include "support/programs/reports.hpp"

#include <globalmatch/registration_options.hpp>

#include <algorithm>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "catch.hpp"
#include "file_checks.hpp"
#include "support/scan_files.hpp"

namespace globalmatch::support::test_reports {

namespace {

bool has(const std::vector<warning>& warnings, const std::string& code) {
  return std::any_of(warnings.begin(), warnings.end(), [&](const warning& w) { return w.code == code; });
}

/// A map without anything to warn of.
stem_map healthy_map() {
  stem_map map;
  map.funnel.ground.cells = 1000;
  map.terrain.status = ground_status::seen;
  for (int i = 0; i < 9; ++i) {
    stem s;
    s.position = {double(i), 2.0 * i, 0};
    s.radius = 0.05 + 0.02 * i;
    map.stems.push_back(s);
  }
  return map;
}

}  // namespace

TEST_CASE("a healthy map has no warnings") {
  CHECK(warnings_of(healthy_map(), {}, false).empty());
}

TEST_CASE("what is odd about the file of a scan is said before what is odd about its map") {
  const temporary_directory directory;
  const scan_file scan = open_scan(directory.file(
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
      "z\nend_header\n1 2 3\n4 5 6\n"));
  const std::vector<warning> warnings = warnings_of(stem_map(), scan, false);
  REQUIRE(warnings.size() > 1);
  CHECK(warnings[0].code == "scan_file");
  CHECK(warnings[0].text.find("announces 1 points") != std::string::npos);
}

TEST_CASE("coordinates in degrees are asked for where no stems were found") {
  const temporary_directory directory;
  points in_degrees, in_metres;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d p(i % 10, i / 10 % 10, i / 100 * 2);
    in_metres.push_back(p);
    in_degrees.emplace_back(11.5 + p.x() / 73'000, 48.1 + p.y() / 111'000, p.z());
  }
  const scan_file degrees = open_scan(directory.file("d.xyz", [&] {
    std::ostringstream text;
    text.precision(12);
    for (const Eigen::Vector3d& p : in_degrees) text << p.transpose() << '\n';
    return text.str();
  }()));
  write_ply(directory / "m.ply", in_metres);
  CHECK(has(warnings_of(stem_map(), degrees, false), "degrees"));
  CHECK_FALSE(has(warnings_of(healthy_map(), degrees, false), "degrees"));
  CHECK_FALSE(has(warnings_of(stem_map(), open_scan(directory / "m.ply"), false), "degrees"));
}

TEST_CASE("what is wrong with a scan is said, each by its code") {
  stem_map map = healthy_map();
  map.terrain.status = ground_status::none;
  CHECK(has(warnings_of(map, {}, false), "no_ground"));
  map = healthy_map();
  map.terrain.cut_off = true;
  CHECK(has(warnings_of(map, {}, false), "cut_off"));
  map = healthy_map();
  map.terrain.status = ground_status::normalised;
  CHECK(has(warnings_of(map, {}, false), "normalised_heights"));
  map = healthy_map();
  map.funnel.ground.coordinate_step = 0.5;
  CHECK(has(warnings_of(map, {}, false), "coordinate_step"));
  map = healthy_map();
  map.funnel.ground.low_points = 3;
  CHECK(has(warnings_of(map, {}, false), "low_noise"));
  map = healthy_map();
  map.stems.clear();
  CHECK(has(warnings_of(map, {}, false), "no_stems"));
  CHECK(has(warnings_of(healthy_map(), {.noise = 2, .withheld = 0}, false), "marked_points"));
}

TEST_CASE("stems that are three times too thick ask whether coordinates are in feet") {
  stem_map map = healthy_map();
  for (stem& s : map.stems) s.radius /= 0.3048;
  const std::vector<warning> warnings = warnings_of(map, {}, false);
  REQUIRE(warnings.size() == 1);
  CHECK(warnings.front().code == "thick_stems");
  CHECK(warnings.front().text.find("0.85 m") != std::string::npos);
  CHECK(warnings.front().text.find("feet") != std::string::npos);
  map.stems.resize(4);  // too few to say
  CHECK(warnings_of(map, {}, false).empty());
}

TEST_CASE("a matching without a known height says so, and so does one whose heights slope") {
  matching result;
  CHECK(warnings_of(result).empty());
  result.vertical.emplace();
  result.vertical->source = vertical_source::stems;
  CHECK(warnings_of(result).empty());
  result.vertical->kind = vertical_kind::sloping;
  result.vertical->tilt = 0.05;
  REQUIRE(has(warnings_of(result), "sloping_heights"));
  CHECK(warnings_of(result).front().text.find("2.9 degrees") != std::string::npos);
  result.vertical->source = vertical_source::none;
  result.vertical->reason = "heights of trees";
  REQUIRE(has(warnings_of(result), "height_unknown"));
  CHECK(warnings_of(result).front().text == "height: heights of trees");
}

TEST_CASE("stems at the place of others are warned of, by map") {
  matching result;
  CHECK(warnings_of(result).empty());
  result.funnel.source_stems = 70;
  result.funnel.source_coincident = 9;
  REQUIRE(warnings_of(result).size() == 1);
  CHECK(warnings_of(result)[0].code == "coincident_stems");
  CHECK(warnings_of(result)[0].text ==
        "source: 9 of 70 stems are at the place of another one and were left out");
  result.funnel.source_coincident = 0;
  result.funnel.target_coincident = 2;
  REQUIRE(warnings_of(result).size() == 1);
  CHECK(warnings_of(result)[0].text.starts_with("target: 2 of 0 stems"));
}

}  // namespace globalmatch::support::test_reports

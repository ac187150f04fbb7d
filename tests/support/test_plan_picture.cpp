#include "support/plan_picture.hpp"

#include <cstdio>
#include <limits>

#include "catch.hpp"
#include "file_checks.hpp"

namespace globalmatch::support::test_plan_picture {

namespace {

using Catch::Matchers::Contains;
using match_list = std::vector<std::pair<stem_index, stem_index>>;

const points target = {{0, 0, 0}, {10, 0, 0}, {0, 7, 0}, {5, 5, 0}};
const points source = {{100, 50, 0}, {110, 50, 0}, {103, 52, 0}};
const std::vector<double> target_radii = {0.1, 0.2, 0.3, std::numeric_limits<double>::quiet_NaN()};
const match_list matches = {{0, 0}, {1, 1}};

Eigen::Isometry3d target_from_source() {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.translation() = Eigen::Vector3d(-100, -50, 0);
  return transform;
}

std::string drawn(const plan_picture& picture) {
  const temporary_directory directory;
  write_plan_picture(directory / "plan.svg", picture);
  return bytes_of(directory / "plan.svg");
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

}  // namespace

TEST_CASE("the plan counts matched and unmatched stems in its legend, and states the outcome") {
  const std::string svg = drawn({.source = {source},
                                 .target = {target, target_radii},
                                 .matches = matches,
                                 .target_from_source = target_from_source(),
                                 .title = "A plot",
                                 .caption = "registered: 2 stems"});
  for (const char* text :
       {">A plot<", ">target: 4 stems<", ">source: 3 stems<", ">2 matched<", ">2 only in target<",
        ">1 only in source<", ">registered: 2 stems<", ">5 m in both panels<"})
    CHECK_THAT(svg, Contains(text));
}

TEST_CASE("the plan draws each stem twice, and a line and a halo for each match") {
  const plan_picture picture = {.source = {source},
                                .target = {target, target_radii},
                                .matches = matches,
                                .target_from_source = target_from_source()};
  const std::string svg = drawn(picture);
  const std::size_t legend_circles = 7, scale_bar_lines = 3;
  CHECK(count(svg, "<circle") == 2 * (target.size() + source.size()) + matches.size() + legend_circles);
  CHECK(count(svg, "<line") == matches.size() + scale_bar_lines);
}

TEST_CASE("the transform brings matched stems together") {
  const std::string svg = drawn({.source = {source},
                                 .target = {target},
                                 .matches = matches,
                                 .target_from_source = target_from_source()});
  // The first match line runs between the centres of its stems, which coincide.
  const std::size_t at = svg.find("<line");
  double x1 = 0, y1 = 0, x2 = 1, y2 = 1;
  REQUIRE(std::sscanf(svg.c_str() + at, "<line x1=\"%lf\" y1=\"%lf\" x2=\"%lf\" y2=\"%lf\"", &x1, &y1, &x2,
                      &y2) == 4);
  CHECK(x1 == x2);
  CHECK(y1 == y2);
  CHECK(x1 > 600);  // in the right panel
}

TEST_CASE("without a registration the plan says so and draws the maps once") {
  const std::string svg = drawn({.source = {source}, .target = {target}, .caption = "not registered"});
  CHECK_THAT(svg, Contains("No registration to show") && !Contains("only in target"));
  CHECK(count(svg, "<circle") == target.size() + source.size() + 2);
}

TEST_CASE("maps of no stem, one stem, and stems in one place can be drawn") {
  const points one = {{5, 5, 5}}, same(4, Eigen::Vector3d(1, 1, 1));
  const std::span<const Eigen::Vector3d> none;
  for (const auto& positions :
       {none, std::span<const Eigen::Vector3d>(one), std::span<const Eigen::Vector3d>(same)}) {
    const std::string svg =
        drawn({.source = {positions}, .target = {none}, .target_from_source = Eigen::Isometry3d::Identity()});
    CHECK_THAT(svg, Contains("</svg>") && !Contains("nan") && !Contains("inf"));
  }
}

TEST_CASE("text with characters of XML does not break the picture, and long captions go to several lines") {
  std::string caption = "e_p < 5 cm & more";
  for (int i = 0; i < 60; ++i) caption += " words";
  const std::string svg =
      drawn({.source = {source}, .target = {target}, .title = "<plot>\n1", .caption = caption});
  CHECK_THAT(svg, Contains("&lt;plot&gt; 1") && Contains("e_p &lt; 5 cm &amp; more"));
  CHECK(count(svg, "words words</text>") == 3);
}

TEST_CASE("the plan's bar is 5 m, or a power of ten times that where 5 m are too short or long") {
  const points wide = {{0, 0, 0}, {800, 400, 0}};
  CHECK_THAT(drawn({.source = {wide}, .target = {wide}}), Contains(">50 m in both panels<"));
  const points small = {{0, 0, 0}, {2, 2, 0}};
  CHECK_THAT(drawn({.source = {small}, .target = {small}}), Contains(">0.5 m in both panels<"));
}

TEST_CASE("arguments of a plan that do not fit are invalid, and no file is left") {
  const temporary_directory directory;
  const auto require_invalid = [&](const plan_picture& picture) {
    CHECK_THROWS_AS(write_plan_picture(directory / "plan.svg", picture), std::invalid_argument);
    CHECK(directory.count_files() == 0);
  };
  const points bad = {{0, std::numeric_limits<double>::infinity(), 0}};
  const match_list beyond_target = {{0, 4}}, beyond_source = {{3, 0}};
  require_invalid({.source = {bad}, .target = {target}});
  require_invalid({.source = {source, target_radii}, .target = {target}});
  require_invalid({.source = {source}, .target = {target}, .matches = beyond_target});
  require_invalid({.source = {source}, .target = {target}, .matches = beyond_source});
}

}  // namespace globalmatch::support::test_plan_picture

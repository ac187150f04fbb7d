#include "globalmatch/detail/survey/stem_deviations.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "globalmatch/detail/core/random.hpp"

#include "catch.hpp"

namespace globalmatch::test_stem_deviations {

using namespace detail;

namespace {

/// A link between two maps whose stems have these deviations.
link_variance link_of(std::uint32_t source, std::uint32_t target, const std::vector<double>& deviations,
                      double pairs = 10000) {
  return {source, target, deviations[source] * deviations[source] + deviations[target] * deviations[target],
          pairs};
}

}  // namespace

TEST_CASE("links between all maps tell the deviation of each") {
  const std::vector<double> truth = {0.01, 0.2, 0.02, 0.03, 0.05};
  std::vector<link_variance> links;
  for (std::uint32_t t = 0; t < 5; ++t)
    for (std::uint32_t s = t + 1; s < 5; ++s) links.push_back(link_of(s, t, truth));
  const std::vector<double> found = deviations_of_maps(links, 6);
  for (std::size_t m = 0; m < 5; ++m) CHECK(found[m] == Approx(truth[m]).margin(0.012));
  CHECK(found[1] > 0.15);
  CHECK(found[5] > 0.01);
}

TEST_CASE(
    "two maps of one link share its variance, and maps that agree to the bit have the least deviation") {
  const std::vector<double> of_two = deviations_of_maps(std::vector{link_of(1, 0, {0.03, 0.04})}, 2);
  CHECK(of_two[0] == Approx(std::sqrt((9e-4 + 16e-4) / 2)).epsilon(1e-3));
  CHECK(of_two[1] == Approx(of_two[0]));
  CHECK(deviations_of_maps(std::vector{link_of(1, 0, {0, 0})}, 2)[0] == Approx(min_stem_deviation));
  CHECK(deviations_of_maps({}, 3)[2] == Approx(min_stem_deviation));
}

TEST_CASE("maps that differ only by chance have one deviation") {
  random_source random(1);
  std::vector<double> truth(12, 0.03);
  truth[3] = 0.3;
  std::vector<link_variance> links;
  for (std::uint32_t t = 0; t < truth.size(); ++t)
    for (std::uint32_t s = t + 1; s < truth.size(); ++s) {
      links.push_back(link_of(s, t, truth, 30));
      links.back().sum *= 1 + 0.26 * random.normal();  // as of the median of 30
    }
  const std::vector<double> found = deviations_of_maps(links, truth.size());
  CHECK(found[0] == Approx(0.03).epsilon(0.1));
  CHECK(found[3] == Approx(0.3).epsilon(0.1));
  CHECK(std::count(found.begin(), found.end(), found[0]) >= 9);
}

TEST_CASE("a link that no cycle supports makes no map inexact that others show to be exact") {
  const std::vector<double> truth = {0.02, 0.02, 0.02, 0.3};
  std::vector<link_variance> links;
  for (std::uint32_t t = 0; t < 3; ++t)
    for (std::uint32_t s = t + 1; s < 3; ++s) links.push_back(link_of(s, t, truth));
  links.push_back({2, 0, 100, 50, false});
  links.push_back(link_of(3, 1, truth));
  links.back().is_supported = false;
  const std::vector<double> found = deviations_of_maps(links, 4);
  for (std::size_t m = 0; m < 3; ++m) CHECK(found[m] == Approx(truth[m]).epsilon(0.01));
  CHECK(found[3] == Approx(truth[3]).epsilon(0.1));
}

TEST_CASE("stems that are off by much more do not make a map inexact") {
  random_source random(2);
  std::vector<prepared_stems> maps(2);
  survey_link link;
  link.source = 1;
  for (stem_index i = 0; i < 200; ++i) {
    const vec3 tree = {random.normal(), random.normal(), 0};
    const double off = i % 4 == 0 ? 0.2 : 0.01;
    maps[0].stems.at.push_back(tree);
    maps[1].stems.at.push_back(tree + vec3{off * random.normal(), off * random.normal(), 0});
    link.correspondences.push_back({i, i});
  }
  const std::vector<double> found = deviations_by_links(maps, std::vector{link});
  CHECK(found[0] == found[1]);
  CHECK(found[0] < 0.015);
  CHECK(found[0] > 0.005);
  link.used = false;
  CHECK(deviations_by_links(maps, std::vector{link})[0] == Approx(min_stem_deviation));
}

TEST_CASE("noise of both maps gives the deviation of each, whatever the transform") {
  random_source random(3);
  std::vector<prepared_stems> maps(2);
  survey_link link;
  link.source = 1;
  link.target_from_source = {{3, -2}, 1.2};
  for (stem_index i = 0; i < 4000; ++i) {
    const vec3 tree = {20 * random.normal(), 20 * random.normal(), 0};
    const vec2 placed = link.target_from_source * tree.xy();
    const auto noise = [&] { return 0.02 * random.normal(); };
    maps[1].stems.at.push_back(tree + vec3{noise(), noise(), 0});
    maps[0].stems.at.push_back({placed.x + noise(), placed.y + noise(), 0});
    link.correspondences.push_back({i, i});
  }
  for (const double found : deviations_by_links(maps, std::vector{link}))
    CHECK(found == Approx(0.02).epsilon(0.05));
}

}  // namespace globalmatch::test_stem_deviations

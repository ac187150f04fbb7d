// Scans as they come when something went wrong, through the whole library: an answer with a reason, never a
// transform and never an exception.
#include "globalmatch/registration.hpp"

#include <cmath>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "support/message_of.hpp"

namespace globalmatch::test_bad_input {

using namespace detail;

namespace {

using scenes::cloud;
using scenes::infinity;
using scenes::nan;
using scenes::small_plot;

/// Each point as `change` makes it.
template <class Change>
cloud changed(cloud points, const Change& change) {
  for (Eigen::Vector3f& p : points) p = change(p);
  return points;
}

/// Refused with a reason that holds `words`, whether the bad scan is source or target.
void check_refused(const cloud& bad, const char* words) {
  static const stem_map good = map_stems(small_plot().scan());
  const stem_map map = map_stems(bad);
  for (const registration& r : {register_maps(map, good), register_maps(good, map)}) {
    CHECK(r.outcome == outcome::not_registered);
    CHECK(!r.target_from_source);
    CHECK_THAT(r.reason, Catch::Contains(words));
  }
}

}  // namespace

TEST_CASE("the plot of these tests is registered when nothing is wrong with it") {
  const cloud scan = small_plot().scan();
  const auto result = register_scans(scan, scan);
  CHECK(result.registration.outcome == outcome::registered);
  CHECK(result.source.stems.size() >= 14);
}

TEST_CASE("a scan without points, or without a finite one, is refused and says so") {
  check_refused({}, "scan: 0 points");
  check_refused(cloud(100, Eigen::Vector3f(nan, 0, infinity)), "scan: 0 points with a place of 100 points");
}

TEST_CASE("one point, equal points and points on a line are refused and say where stems were lost") {
  check_refused({{1, 2, 3}}, "0 stems");
  check_refused(cloud(5000, Eigen::Vector3f(1, 2, 3)), "understory: 0 understory points of 5000");
  cloud line;
  for (int i = 0; i < 5000; ++i) line.push_back({0.01f * float(i), 0, 0});
  check_refused(line, "understory: 0 understory points of 5000");
}

TEST_CASE("a scan without stems is refused, as is one without ground") {
  check_refused(small_plot().ground, "understory: 0 understory points");
  const stem_map no_ground = map_stems(small_plot().stems);
  const registration r = register_maps(no_ground, map_stems(small_plot().scan()));
  // Stems stand on what was taken for ground beneath them: registered rightly, or not at all.
  if (r.target_from_source)
    CHECK((r.target_from_source->translation() - Eigen::Vector3d::Zero()).norm() < 0.1);
  else
    CHECK(!r.reason.empty());
}

TEST_CASE("a scan upside down is refused") {
  const auto upside_down = [](const auto& p) { return Eigen::Vector3f(p.x(), -p.y(), -p.z()); };
  check_refused(changed(small_plot().scan(), upside_down), "stems");
}

TEST_CASE("a scan in millimetres or centimetres is refused at once, with the unit and the remedy") {
  for (const auto& [factor, words] : {std::pair(1000.0f, "millimetres? Multiply them by 0.001"),
                                      {100.0f, "centimetres? Multiply them by 0.01"}}) {
    const auto scaled = [scale = factor](const auto& p) { return Eigen::Vector3f(scale * p); };
    CHECK_THAT(support::message_of([&] { map_stems(changed(small_plot().scan(), scaled)); }),
               Catch::Contains(words));
  }
}

TEST_CASE("points that are not finite, doubled or a million kilometres away change nothing") {
  const small_plot p;
  cloud worse = p.scan();
  const stem_map right = map_stems(worse);
  worse.insert(worse.end(), worse.begin(), worse.begin() + 5000);
  for (const Eigen::Vector3f& bad : {Eigen::Vector3f(nan, 1, 1), Eigen::Vector3f(1, infinity, 1),
                                     Eigen::Vector3f(1e9f, 1e9f, 0), Eigen::Vector3f(0, -1e9f, 1e9f)})
    worse.insert(worse.begin(), bad);
  const registration r = register_maps(map_stems(worse), right);
  REQUIRE(r.outcome == outcome::registered);
  CHECK((r.target_from_source->matrix() - Eigen::Matrix4d::Identity()).norm() < 0.01);
}

TEST_CASE("a scan in map coordinates is registered with one in its own") {
  const small_plot p;
  const Eigen::Vector3d far_away(500000, 5300000, 1000);
  std::vector<Eigen::Vector3d> moved;
  for (const Eigen::Vector3f& q : p.scan()) moved.push_back(q.cast<double>() + far_away);
  const auto result = register_scans(moved, p.scan());
  REQUIRE(result.registration.outcome == outcome::registered);
  CHECK((result.registration.target_from_source->translation() + far_away).norm() < 0.01);
}

}  // namespace globalmatch::test_bad_input

#include "globalmatch/detail/matching/visibility_evidence.hpp"

#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include "catch.hpp"
#include "globalmatch/registration.hpp"
#include "seen_forest.hpp"

namespace globalmatch::test_visibility_evidence {

using namespace detail;

namespace {

using scenes::station;

/// Two stations of a forest, of whose common stems few are in both maps.
struct two_stations {
  station source, target;
  Eigen::Isometry3d truth;  ///< target from source

  two_stations(const std::vector<scenes::trunk>& trunks, random_source& random, std::size_t common)
      : source(trunks, {-6, 1}, 0.4, random),
        target(trunks, {7, -2}, -1.9, random),
        truth(target.forest_from_scan.inverse() * source.forest_from_scan) {
    source.keep_common(trunks, target, common);
  }

  double error_of(const Eigen::Isometry3d& transform) const {
    return scenes::max_error(transform, truth, {Eigen::Vector3d(5, 0, 0), Eigen::Vector3d(-5, 8, 0)});
  }
};

/// Evidence of two maps, asked for transforms between their frames.
struct asked {
  position_set from, to;
  scan_views views;
  matching_context context;

  asked(const stem_map& source, const stem_map& target)
      : from(import_positions(source.stems, source.up, "source")),
        to(import_positions(target.stems, target.up, "target")),
        views{{&source.visible, &source.terrain}, {&target.visible, &target.terrain}},
        context(from, to, true, degrees_of_freedom::four) {}

  local_hypothesis of(const Eigen::Isometry3d& target_from_source) const {
    local_hypothesis h;
    h.target_from_source =
        to.frame.local_from_scan() * from_eigen(target_from_source) * from.frame.local_from_scan().inverse();
    h.inlier_threshold = 0.1;
    h.correspondences = context.pair_stems(h.target_from_source, 1.5);
    h.rms = 0.02;
    h.log10_nfa = 1;
    return h;
  }
  evidence_score score(const local_hypothesis& h) const {
    return visibility_evidence(context, views).score(h);
  }
};

}  // namespace

TEST_CASE("visibility supports the transform between two stations, and no other one") {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    random_source random(seed);
    const two_stations scans(scenes::random_trunks(random, 220, 60), random, 4);
    const asked evidence(scans.source.map, scans.target.map);
    const local_hypothesis right = evidence.of(scans.truth);
    const evidence_score scored = evidence.score(right);
    CHECK(scored.source == evidence_source::visibility);
    CHECK(scored.log10_nfa < -4);
    CHECK(scored.log10_nfa_poisson == right.log10_nfa_poisson);
    for (int k = 1; k < 12; ++k) {
      const Eigen::Isometry3d turned = scans.truth * Eigen::AngleAxisd(0.5 * k, Eigen::Vector3d::UnitZ());
      local_hypothesis wrong = evidence.of(turned);
      wrong.correspondences = right.correspondences;
      CHECK(evidence.score(wrong).log10_nfa > 0);
    }
  }
}

TEST_CASE("where visibility supports the transform shifted along rows, too, it is no evidence") {
  random_source random(4);
  std::vector<scenes::trunk> rows;
  for (int column = -12; column <= 12; ++column)
    for (int row = -12; row <= 12; ++row)
      if (random.uniform() < 0.98) rows.push_back({{2.5 * column, 2.5 * row}, 0.15});
  const two_stations scans(rows, random, rows.size());
  const asked evidence(scans.source.map, scans.target.map);
  const Eigen::Isometry3d& target = scans.target.forest_from_scan;
  for (const double along : {0.0, 2.5}) {
    const local_hypothesis h =
        evidence.of(target.inverse() * Eigen::Translation3d(along, 0, 0) * target * scans.truth);
    CHECK(h.correspondences.size() > 50);
    CHECK(evidence.score(h).log10_nfa == h.log10_nfa);
  }
}

TEST_CASE("unrelated stands are not more often supported than is said, also along rows") {
  // Rows 4 m apart, of stems at any distance along them: no lattice is found in them.
  const auto rows = [](random_source& random) {
    std::vector<scenes::trunk> trunks;
    for (int row = -8; row <= 8; ++row)
      for (double along = -32; along < 32; along += 0.5 + 0.7 * random.uniform())
        trunks.push_back({{along, 4 * row + 2 + 0.05 * random.normal()}, 0.1 + 0.05 * random.uniform()});
    return trunks;
  };
  for (const bool in_rows : {false, true}) {
    CAPTURE(in_rows);
    std::size_t transforms = 0, supported = 0;
    for (std::uint64_t seed = 50; seed < 55; ++seed) {
      random_source random(seed);
      const auto stand = [&] { return in_rows ? rows(random) : scenes::random_trunks(random, 220, 60); };
      const station source(stand(), {0, 0}, 0.4, random), target(stand(), {0, 0}, -1.9, random);
      const asked evidence(source.map, target.map);
      for (int k = 0; k < 30; ++k) {
        const double yaw = in_rows ? 0.01 * random.normal() : 6 * random.uniform();
        const Eigen::Isometry3d in_forest(Eigen::Translation3d(20 * (random.uniform() - 0.5),
                                                               4.0 * (k % 3 - 1) + 0.1 * random.normal(), 0) *
                                          Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
        const local_hypothesis h =
            evidence.of(target.forest_from_scan.inverse() * in_forest * source.forest_from_scan);
        if (h.correspondences.size() < 3) continue;
        ++transforms;
        supported += evidence.score(h).log10_nfa < h.log10_nfa;
      }
    }
    CHECK(transforms > 100);
    CHECK(supported <= 2);
  }
}

TEST_CASE("a scan that hides everything supports no transform") {
  random_source random(5);
  two_stations scans(scenes::random_trunks(random, 220, 60), random, 4);
  for (stem_map* map : {&scans.source.map, &scans.target.map})
    for (auto& range : map->visible.ranges) range = std::min<std::uint16_t>(range, 400);
  const asked evidence(scans.source.map, scans.target.map);
  const local_hypothesis right = evidence.of(scans.truth);
  CHECK(evidence.score(right).log10_nfa == right.log10_nfa);
}

TEST_CASE("two scans with few common stems are registered by what their scanners saw") {
  std::size_t with = 0, without = 0, wrong = 0;
  for (std::uint64_t seed = 10; seed < 20; ++seed) {
    random_source random(seed);
    two_stations scans(scenes::random_trunks(random, 220, 60), random, 5);
    const auto is_right = [&](const registration& r) {
      wrong += r.target_from_source && scans.error_of(*r.target_from_source) > 0.5;
      return r.target_from_source && scans.error_of(*r.target_from_source) < 0.5;
    };
    const registration seen =
        register_maps(scans.source.map, scans.target.map, scenes::with_icp(icp_metric::none));
    with += is_right(seen);
    if (is_right(seen)) CHECK(seen.matching.probability > 0.5);
    for (stem_map* map : {&scans.source.map, &scans.target.map}) map->visible = {};
    without +=
        is_right(register_maps(scans.source.map, scans.target.map, scenes::with_icp(icp_metric::none)));
  }
  CHECK(wrong == 0);
  CHECK(with >= 8);
  CHECK(without <= 5);
}

TEST_CASE("scans of different forests are not registered by what their scanners saw") {
  for (std::uint64_t seed = 30; seed < 36; ++seed) {
    random_source random(seed);
    const station source(scenes::random_trunks(random, 220, 60), {-6, 1}, 0.4, random);
    const station target(scenes::random_trunks(random, 220, 60), {7, -2}, -1.9, random);
    const registration result = register_maps(source.map, target.map, scenes::with_icp(icp_metric::none));
    CHECK(result.outcome == outcome::not_registered);
  }
}

}  // namespace globalmatch::test_visibility_evidence

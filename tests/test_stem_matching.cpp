#include "globalmatch/stem_matching.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>

#include "catch.hpp"
#include "position_types.hpp"
#include "rioja_plots.hpp"
#include "stem_scenes.hpp"
#include "support/stem_files.hpp"

namespace globalmatch::test_stem_matching {

using namespace detail;

using scenes::positions;

namespace {

void require_same_bits(const matching& a, const matching& b) {
  CHECK(a.outcome == b.outcome);
  CHECK(a.reason == b.reason);
  CHECK(a.funnel.local_pairs == b.funnel.local_pairs);
  CHECK(a.funnel.consensus == b.funnel.consensus);
  REQUIRE(a.hypotheses.size() == b.hypotheses.size());
  for (std::size_t i = 0; i < a.hypotheses.size(); ++i) {
    CHECK(a.hypotheses[i].correspondences == b.hypotheses[i].correspondences);
    CHECK(a.hypotheses[i].target_from_source.matrix() == b.hypotheses[i].target_from_source.matrix());
    CHECK(a.hypotheses[i].rms == b.hypotheses[i].rms);
  }
}

/// Checks what every result promises, whatever the outcome.
void require_coherent(const matching& result) {
  CHECK(result.reason.empty() == (result.outcome == outcome::registered));
  CHECK(result.target_from_source.has_value() == (result.outcome == outcome::registered));
  CHECK(std::is_sorted(result.hypotheses.begin(), result.hypotheses.end(),
                       [](const hypothesis& a, const hypothesis& b) {
                         return std::tuple(a.log10_nfa, -double(a.correspondences.size()), a.rms) <
                                std::tuple(b.log10_nfa, -double(b.correspondences.size()), b.rms);
                       }));
  for (const hypothesis& h : result.hypotheses) {
    CHECK(h.target_from_source.matrix().allFinite());
    CHECK(std::is_sorted(h.correspondences.begin(), h.correspondences.end()));
  }
}

}  // namespace

TEST_CASE("match_stems registers maps of half overlap, false stems and noise, right to 3 cm", "[slow]") {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    const auto views = scenes::half_overlapping_views(random, 60);
    const matching result = match_stems(views.source, views.target);
    require_coherent(result);
    CHECK(result.outcome == outcome::registered);
    if (result.target_from_source)
      CHECK(scenes::max_error(*result.target_from_source, views.target_from_source, views.source) < 0.03);
  }
}

TEST_CASE("match_stems registers a few maps of half overlap right to 3 cm, 4-DoF and 6-DoF") {
  for (std::uint64_t seed = 100; seed < 104; ++seed)
    for (const auto dof : {degrees_of_freedom::four, degrees_of_freedom::six}) {
      INFO("seed " << seed << ", dof " << int(dof));
      random_source random(seed);
      const auto views = scenes::half_overlapping_views(random, 40);
      const matching result = match_stems(views.source, views.target, {.dof = dof});
      require_coherent(result);
      REQUIRE(result.outcome == outcome::registered);
      const auto error =
          scenes::max_error(*result.target_from_source, views.target_from_source, views.source);
      CHECK(error < (dof == degrees_of_freedom::four ? 0.03 : 0.06));
    }
}

TEST_CASE("match_stems never registers two unrelated maps", "[slow]") {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    const double side = 30;
    const std::size_t source_count = 30 + random.below(71), target_count = 30 + random.below(71);
    const positions source = scenes::random_stems(random, source_count, side, side);
    const positions target = scenes::moved(scenes::random_levelled_transform(random),
                                           scenes::random_stems(random, target_count, side, side));
    const matching result = match_stems(source, target, {.inlier_threshold = 0.05});
    require_coherent(result);
    CHECK(result.outcome != outcome::registered);
  }
}

TEST_CASE("match_stems does not register two unrelated maps of thirty stems") {
  for (std::uint64_t seed = 200; seed < 220; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    const matching result =
        match_stems(scenes::random_stems(random, 30, 25, 25), scenes::random_stems(random, 30, 25, 25));
    require_coherent(result);
    CHECK(result.outcome != outcome::registered);
  }
}

TEST_CASE("match_stems never registers unrelated rows, however many stems are inliers along them", "[slow]") {
  for (const int rows : {10, 25}) {
    CAPTURE(rows);
    for (std::uint64_t seed = 0; seed < (rows < 20 ? 4u : 1u); ++seed) {
      random_source random(seed);
      const auto plantation = [&] { return scenes::noisy(scenes::lattice(rows, rows, 3), 0.12, random); };
      const positions source = plantation();
      const positions target = scenes::moved(scenes::random_levelled_transform(random), plantation());
      CHECK(match_stems(source, target).outcome != outcome::registered);
    }
  }
}

TEST_CASE("rows within a stand of another kind are no evidence either") {
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    random_source random(seed);
    const auto block = [&] { return scenes::noisy(scenes::lattice(10, 12, 3), 0.12, random); };
    const positions source = block();
    positions target = scenes::moved(scenes::yaw_and_shift(0, {70, 0, 0}), block());
    for (const Eigen::Vector3d& p : scenes::random_stems(random, 324, 60, 60)) target.push_back(p);
    CHECK(match_stems(source, target, {.horizontal = true}).outcome != outcome::registered);
  }
}

TEST_CASE("jittered rows that overlap by half are registered rightly") {
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    random_source random(seed);
    const positions rows = scenes::noisy(scenes::lattice(30, 20, 3), 0.12, random);
    const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
    positions source, target;
    for (const Eigen::Vector3d& p : rows) {
      if (p.x() < 60) source.push_back(p);
      if (p.x() > 30) target.push_back(truth * p);
    }
    source = scenes::noisy(source, 0.01, random);
    const matching result = match_stems(source, target);
    REQUIRE(result.outcome == outcome::registered);
    CHECK(scenes::max_error(*result.target_from_source, truth, source) < 0.03);
  }
}

TEST_CASE("a plot and the forest around it match in either direction, by the same pairs") {
  random_source random(3);
  const positions forest = scenes::random_stems(random, 3000, 180, 180);
  const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
  positions plot;
  for (const Eigen::Vector3d& p : forest)
    if ((p - Eigen::Vector3d(90, 90, 0)).head<2>().norm() < 12) plot.push_back(truth * p);
  plot = scenes::noisy(plot, 0.01, random);
  const matching there = match_stems(forest, plot), back = match_stems(plot, forest);
  REQUIRE(there.target_from_source);
  REQUIRE(back.target_from_source);
  CHECK(scenes::max_error(*there.target_from_source * *back.target_from_source, Eigen::Isometry3d::Identity(),
                          plot) < 1e-9);
  CHECK(scenes::max_error(*there.target_from_source, truth, {{90, 90, 0}}) < 0.03);
  CHECK(there.funnel.source_stems == forest.size());
  CHECK(there.funnel.target_stems == plot.size());
  REQUIRE(there.hypotheses.front().correspondences.size() == back.hypotheses.front().correspondences.size());
  for (const correspondence& c : there.hypotheses.front().correspondences)
    CHECK((truth * forest[c.source] - plot[c.target]).head<2>().norm() < 0.1);
}

TEST_CASE("large forests that have nothing in common are not registered") {
  random_source random(4);
  const positions source = scenes::random_stems(random, 20000, 470, 470);
  const positions target = scenes::random_stems(random, 20000, 470, 470);
  CHECK(match_stems(source, target).outcome == outcome::not_registered);
}

TEST_CASE("two stands far apart are matched as one") {
  random_source random(5);
  positions stems = scenes::random_stems(random, 300, 60, 60);
  for (const Eigen::Vector3d& p : scenes::random_stems(random, 300, 60, 60))
    stems.push_back(p + Eigen::Vector3d(100000, 100000, 0));
  const Eigen::Isometry3d truth = scenes::yaw_and_shift(0.5, {10, 20, 3});
  const matching result = match_stems(stems, scenes::moved(truth, stems));
  REQUIRE(result.target_from_source);
  CHECK(scenes::max_error(*result.target_from_source, truth, stems) < 0.001);
}

TEST_CASE("the returned hypotheses are distinct") {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    random_source random(seed);
    const auto views = scenes::half_overlapping_views(random, 40);
    const positions source = scenes::noisy(views.source, 0.1, random);
    const matching result = match_stems(source, views.target);
    CAPTURE(seed);
    for (std::size_t i = 0; i < result.hypotheses.size(); ++i)
      for (std::size_t j = i + 1; j < result.hypotheses.size(); ++j) {
        const hypothesis &a = result.hypotheses[i], &b = result.hypotheses[j];
        double sum = 0;
        for (const hypothesis* h : {&a, &b})
          for (const correspondence& c : h->correspondences)
            sum += (a.target_from_source * source[c.source] - b.target_from_source * source[c.source])
                       .head<2>()
                       .norm();
        CHECK(sum > 2 * std::max(a.inlier_threshold, b.inlier_threshold) *
                        double(a.correspondences.size() + b.correspondences.size()) * (1 - 1e-9));
      }
  }
}

TEST_CASE("match_stems calls a perfect lattice ambiguous") {
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    const positions stems = scenes::lattice(6, 6, 2.5);
    const positions source = scenes::noisy(stems, 0.02, random);
    const positions target =
        scenes::moved(scenes::random_levelled_transform(random), scenes::noisy(stems, 0.02, random));
    const matching result = match_stems(source, target);
    require_coherent(result);
    CHECK(result.outcome == outcome::ambiguous);
    CHECK(result.hypotheses.size() >= 2);
    CHECK(!result.uncertainty);
    REQUIRE(result.lattice);
    CHECK(result.lattice->first.norm() == Approx(2.5).epsilon(0.01));
    CHECK(result.lattice->second.norm() == Approx(2.5).epsilon(0.01));
  }
}

TEST_CASE("the alternatives of a lattice are its shifts and turns") {
  random_source random(1);
  const positions stems = scenes::lattice(8, 7, 2.5);
  const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
  const matching result = match_stems(scenes::noisy(stems, 0.02, random),
                                      scenes::moved(truth, scenes::noisy(stems, 0.02, random)));
  REQUIRE(result.hypotheses.size() >= 4);
  for (const hypothesis& alternative : result.hypotheses) {
    const Eigen::Isometry3d own = truth.inverse() * alternative.target_from_source;
    const double yaw = std::atan2(own.linear()(1, 0), own.linear()(0, 0));
    CHECK(std::abs(std::remainder(yaw, std::numbers::pi / 2)) < 0.05);
    CHECK(std::abs(std::remainder(own.translation().x(), 2.5)) < 0.3);
    CHECK(std::abs(std::remainder(own.translation().y(), 2.5)) < 0.3);
  }
}

TEST_CASE("gaps in perfect rows break the tie, whichever map is the larger one, and it is said") {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    positions stems = scenes::lattice(14, 13, 3);
    std::erase_if(stems, [&](const Eigen::Vector3d&) { return random.uniform() < 0.12; });
    const auto scan = [&] {
      positions seen = scenes::noisy(stems, 0.02, random);
      std::erase_if(seen, [&](const Eigen::Vector3d&) { return random.uniform() < 0.02; });
      return seen;
    };
    const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
    positions source = scan(), target = scenes::moved(truth, scan());
    (seed % 2 == 0 ? source : target).resize(120);
    const matching result = match_stems(source, target);
    REQUIRE(result.outcome == outcome::registered);
    CHECK(scenes::max_error(*result.target_from_source, truth, source) < 0.05);
    CHECK(result.hypotheses.front().evidence == evidence_source::gaps);
    REQUIRE(result.lattice);
    const double yaw = std::atan2(truth.linear()(1, 0), truth.linear()(0, 0));
    CHECK(std::abs(std::remainder(result.lattice->direction() - yaw, std::numbers::pi / 2)) < 0.02);
  }
}

TEST_CASE(
    "in rows as noisy as they are crooked the residuals break the tie, whichever map is the larger one") {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const positions stems = scenes::noisy(scenes::lattice(13, 11, 3), 0.12, random);
    const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
    positions source = scenes::noisy(stems, 0.1, random);
    positions target = scenes::moved(truth, scenes::noisy(stems, 0.1, random));
    (seed % 2 == 0 ? source : target).resize(120);
    const matching result = match_stems(source, target);
    REQUIRE(result.outcome == outcome::registered);
    CHECK(scenes::max_error(*result.target_from_source, truth, source) < 0.2);
    CHECK(result.hypotheses.front().evidence == evidence_source::residuals);
    CHECK(result.hypotheses.front().correspondences.size() > 100);
  }
}

TEST_CASE("in perfect rows on level ground the radii break the tie, where both maps have them") {
  struct thick_stem {
    double x, y, z, radius;
  };
  const auto with_radii = [](const positions& stems, const std::vector<double>& radii,
                             random_source& random) {
    std::vector<thick_stem> thick;
    for (std::size_t i = 0; i < stems.size(); ++i)
      thick.push_back({stems[i].x(), stems[i].y(), stems[i].z(), radii[i] + 0.005 * random.normal()});
    return thick;
  };
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const positions stems = scenes::lattice(11, 9, 3);
    std::vector<double> radii;
    for (std::size_t i = 0; i < stems.size(); ++i) radii.push_back(0.12 + 0.02 * random.normal());
    const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
    const positions source = scenes::noisy(stems, 0.02, random);
    positions target = scenes::moved(truth, scenes::noisy(stems, 0.02, random));
    if (seed == 2) target.resize(80);  // the smaller one asks: the maps are swapped
    const auto thick_source = with_radii(source, radii, random),
               thick_target = with_radii(target, radii, random);
    const matching result = match_stems(thick_source, thick_target);
    REQUIRE(result.outcome == outcome::registered);
    CHECK(scenes::max_error(*result.target_from_source, truth, source) < 0.05);
    CHECK(result.hypotheses.front().evidence == evidence_source::radii);
    CHECK(match_stems(source, thick_target).outcome == outcome::ambiguous);
    CHECK(match_stems(thick_source, target).outcome == outcome::ambiguous);
    CHECK(match_stems(thick_source, prepare_map(thick_target)).outcome == outcome::registered);
  }
}

TEST_CASE("stems that stand anywhere have no lattice") {
  random_source random(1);
  const auto views = scenes::half_overlapping_views(random, 100);
  const matching result = match_stems(views.source, views.target);
  CHECK(result.outcome == outcome::registered);
  CHECK(!result.lattice);
  CHECK(result.hypotheses.front().evidence == evidence_source::positions);
}

TEST_CASE("what is registered says how far off it may be, in the target's frame, for any up") {
  const Eigen::Vector3d up(0.2, -0.1, 1);
  for (const degrees_of_freedom dof : {degrees_of_freedom::four, degrees_of_freedom::six}) {
    random_source random(2);
    const auto views = scenes::half_overlapping_views(random, 60);
    const Eigen::Isometry3d tilted =
        Eigen::Translation3d(300, 200, 100) *
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), up.normalized());
    const positions source = scenes::moved(tilted, views.source),
                    target = scenes::moved(tilted, views.target);
    matching_options options;
    options.dof = dof;
    const matching result = match_stems(source, target, options, up);
    REQUIRE(result.target_from_source);
    REQUIRE(result.uncertainty);
    CHECK(result.uncertainty->covariance.rows() == int(dof));
    const Eigen::Isometry3d truth = tilted * views.target_from_source * tilted.inverse();
    const double off = (truth * source[0] - *result.target_from_source * source[0]).norm();
    const double expected = result.uncertainty->expected_error(truth * source[0]);
    CHECK(expected > 1e-4);
    CHECK(expected < 0.05);
    CHECK(off < 4 * expected);
  }
}

TEST_CASE("match_stems takes positions of any type and says whether it knows the height") {
  random_source random(1);
  const positions stems = scenes::random_stems(random, 14, 20, 20);
  const Eigen::Isometry3d truth = scenes::yaw_and_shift(0.4, {3, -8, 2});
  const positions target = scenes::moved(truth, stems);
  scenes::for_each_type_with_heights(stems, [&](const char* name, const auto& range) {
    INFO(name);
    const matching result = match_stems(range, target);
    REQUIRE(result.outcome == outcome::registered);
    REQUIRE(result.vertical);
    CHECK(result.vertical->source == vertical_source::stems);
    CHECK(scenes::max_error(*result.target_from_source, truth, stems) < 1e-9);
  });
  scenes::for_each_type_without_heights(stems, [&](const char* name, const auto& range) {
    INFO(name);
    for (const bool reversed : {false, true}) {
      const matching result = reversed ? match_stems(target, range) : match_stems(range, target);
      REQUIRE(result.outcome == outcome::registered);
      REQUIRE(result.vertical);
      CHECK_FALSE(result.vertical->is_known());
      const Eigen::Isometry3d transform =
          reversed ? result.target_from_source->inverse() : *result.target_from_source;
      for (const Eigen::Vector3d& p : stems) CHECK((transform * p - truth * p).head<2>().norm() < 1e-9);
    }
    CHECK_THROWS_WITH(match_stems(range, target, {.dof = degrees_of_freedom::six}), Catch::Contains("dof"));
    CHECK_THROWS_AS(match_stems(target, range, {.dof = degrees_of_freedom::six}), std::invalid_argument);
  });
}

TEST_CASE("horizontal match_stems ignores heights that are wrong by metres") {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    auto views = scenes::half_overlapping_views(random, 40);
    const matching expected = match_stems(views.source, views.target, {.horizontal = true});
    for (Eigen::Vector3d& p : views.source) p.z() = scenes::uniform(random, -20, 20);
    const matching result = match_stems(views.source, views.target, {.horizontal = true});
    REQUIRE(result.vertical);
    CHECK_FALSE(result.vertical->is_known());
    CHECK(result.outcome == outcome::registered);
    REQUIRE(result.hypotheses.size() == expected.hypotheses.size());
    for (std::size_t i = 0; i < result.hypotheses.size(); ++i)
      CHECK(result.hypotheses[i].correspondences == expected.hypotheses[i].correspondences);
    const auto& best = result.hypotheses.front().target_from_source;
    for (const Eigen::Vector3d& p : views.source)
      CHECK((best * p - views.target_from_source * p).head<2>().norm() < 0.04);
  }
}

TEST_CASE("match_stems gives the same bits for any number of threads") {
  random_source random(2);
  const auto views = scenes::half_overlapping_views(random, 40);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const matching expected = match_stems(views.source, views.target, {}, up, {.threads = 1});
  CHECK(expected.outcome == outcome::registered);
  for (const int threads : {0, 2, 8})
    require_same_bits(match_stems(views.source, views.target, {}, up, {.threads = threads}), expected);
}

TEST_CASE("maps of thousands give the same bits for any number of threads and stems in any order") {
  random_source random(8);
  const positions forest = scenes::random_stems(random, 6000, 260, 260);
  const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
  positions source, target;
  for (const Eigen::Vector3d& p : forest) {
    if (p.x() < 170) source.push_back(p);
    if (p.x() > 90) target.push_back(truth * p);
  }
  source = scenes::noisy(source, 0.01, random);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const matching expected = match_stems(source, target, {}, up, {.threads = 1});
  REQUIRE(expected.target_from_source);
  CHECK(scenes::max_error(*expected.target_from_source, truth, source) < 0.03);
  const auto source_order = scenes::random_order(source.size(), random);
  const auto target_order = scenes::random_order(target.size(), random);
  for (const int threads : {2, 8}) {
    require_same_bits(match_stems(source, target, {}, up, {.threads = threads}), expected);
    const matching shuffled =
        match_stems(scenes::reordered(source, source_order), scenes::reordered(target, target_order), {}, up,
                    {.threads = threads});
    REQUIRE(shuffled.target_from_source);
    CHECK(shuffled.target_from_source->matrix() == expected.target_from_source->matrix());
    CHECK(shuffled.hypotheses.front().correspondences.size() ==
          expected.hypotheses.front().correspondences.size());
  }
}

TEST_CASE("match_stems gives the same bits for stems in any order, and maps correspondences back") {
  random_source random(3);
  const auto views = scenes::half_overlapping_views(random, 40);
  const matching expected = match_stems(views.source, views.target);
  CHECK(expected.outcome == outcome::registered);
  for (int iteration = 0; iteration < 4; ++iteration) {
    const auto source_order = scenes::random_order(views.source.size(), random);
    const auto target_order = scenes::random_order(views.target.size(), random);
    matching result = match_stems(scenes::reordered(views.source, source_order),
                                  scenes::reordered(views.target, target_order));
    for (hypothesis& h : result.hypotheses) {
      for (correspondence& c : h.correspondences)
        c = {static_cast<stem_index>(source_order[c.source]),
             static_cast<stem_index>(target_order[c.target])};
      std::sort(h.correspondences.begin(), h.correspondences.end());
    }
    require_same_bits(result, expected);
  }
}

TEST_CASE("the pairs of every hypothesis lie within the tolerance in the caller's frames") {
  random_source random(4);
  const auto views = scenes::half_overlapping_views(random, 40);
  const matching result = match_stems(views.source, views.target, {.inlier_threshold = 0.1});
  CHECK(result.inlier_threshold == 0.1);
  REQUIRE_FALSE(result.hypotheses.empty());
  for (const hypothesis& h : result.hypotheses)
    for (const correspondence& c : h.correspondences)
      CHECK((h.target_from_source * views.source[c.source] - views.target[c.target]).head<2>().norm() < 0.1);
}

TEST_CASE("the matching funnel counts what each step of Algorithm 1 left") {
  random_source random(5);
  const positions stems = scenes::random_stems(random, 15, 20, 20);
  const matching result =
      match_stems(stems, stems, {.inlier_threshold = 0.05, .proposal = proposal::algorithm_1});
  CHECK(result.funnel.source_stems == 15);
  CHECK(result.funnel.target_stems == 15);
  CHECK(result.funnel.source_triangles == 15 * 14 * 13 / 6);
  CHECK(result.funnel.target_triangles == result.funnel.source_triangles);
  CHECK(result.funnel.local_pairs == result.funnel.target_triangles);
  CHECK(result.funnel.consensus <= result.funnel.local_pairs);
  CHECK(result.funnel.consensus > result.funnel.local_pairs / 2);
  CHECK(result.funnel.correspondences == 15);
  CHECK(result.inlier_threshold == 0.05);
}

TEST_CASE("the matching funnel counts queries and candidates, of triangles or in small maps of stars") {
  random_source random(5);
  for (const std::size_t size : {15u, 150u}) {
    const positions stems = scenes::random_stems(random, size, 60, 60);
    const matching result = match_stems(stems, stems);
    CHECK(result.funnel.source_stems == size);
    CHECK(result.funnel.target_triangles >= size);
    CHECK(result.funnel.source_triangles > 0);
    CHECK(result.funnel.local_pairs > 0);
    CHECK(result.funnel.tested > 0);
    CHECK(result.funnel.correspondences == size);
  }
}

TEST_CASE("both proposals find the same transform") {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    random_source random(seed);
    const auto views = scenes::half_overlapping_views(random, 50);
    const matching indexed = match_stems(views.source, views.target);
    const matching exhaustive = match_stems(views.source, views.target, {.proposal = proposal::algorithm_1});
    REQUIRE(indexed.outcome == outcome::registered);
    REQUIRE(exhaustive.outcome == outcome::registered);
    CHECK(indexed.hypotheses.front().correspondences == exhaustive.hypotheses.front().correspondences);
  }
}

TEST_CASE("without a threshold the one of the noise is found, and the transform is right") {
  for (const double sigma : {0.01, 0.05, 0.15}) {
    random_source random(11);
    const positions stems = scenes::random_stems(random, 80, 35, 35);
    const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
    const positions target = scenes::moved(truth, scenes::noisy(stems, sigma, random));
    const matching result = match_stems(stems, target, {.horizontal = true});
    CAPTURE(sigma, result.inlier_threshold, result.reason);
    REQUIRE(result.outcome == outcome::registered);
    CHECK(result.inlier_threshold > sigma);
    CHECK(result.inlier_threshold < 7 * sigma);
    for (const Eigen::Vector3d& p : stems)
      CHECK((*result.target_from_source * p - truth * p).head<2>().norm() < 2 * sigma);
  }
}

TEST_CASE("a small plot is found in a prepared map, as by match_stems with the map itself") {
  random_source random(12);
  const positions forest = scenes::random_stems(random, 4000, 210, 210);
  const prepared_map prepared = prepare_map(forest);
  int found = 0;
  for (int i = 0; i < 10; ++i) {
    positions plot;
    const Eigen::Vector3d center(scenes::uniform(random, 20, 190), scenes::uniform(random, 20, 190), 0);
    for (const Eigen::Vector3d& p : forest)
      if ((p - center).head<2>().norm() < 10 && random.uniform() < 0.85) plot.push_back(p);
    const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
    plot = scenes::noisy(scenes::moved(truth.inverse(), plot), 0.01, random);
    const matching result = match_stems(plot, prepared);
    found += result.target_from_source && scenes::max_error(*result.target_from_source, truth, plot) < 0.05;
    if (i == 0) require_same_bits(result, match_stems(plot, forest));
  }
  CHECK(found == 10);
}

TEST_CASE("a map that was not prepared is named, as are heights that it lacks") {
  const positions stems = {{0, 0, 0}, {1, 3, 0}, {5, 2, 0}, {4, 7, 0}};
  CHECK_THROWS_WITH(match_stems(stems, prepared_map{}), Catch::Contains("prepare_map"));
  const std::vector<Eigen::Vector2d> horizontal_distances = {{0, 0}, {1, 3}, {5, 2}, {4, 7}};
  CHECK_THROWS_WITH(prepare_map(horizontal_distances, {.dof = degrees_of_freedom::six}),
                    Catch::Contains("need heights"));
}

TEST_CASE("a map prepared for one kind of distances refuses the other") {
  random_source random(13);
  const positions stems = scenes::random_stems(random, 20, 20, 20);
  const matching_options six = {.dof = degrees_of_freedom::six};
  CHECK_THROWS_WITH(match_stems(stems, prepare_map(stems, six)), Catch::Contains("prepare it with dof four"));
  CHECK_THROWS_WITH(match_stems(stems, prepare_map(stems), six), Catch::Contains("prepare it with dof six"));
  CHECK(match_stems(stems, prepare_map(stems, six), six).outcome == outcome::registered);
  const std::vector<Eigen::Vector2d> horizontal_distances(5, Eigen::Vector2d::Zero());
  CHECK_NOTHROW(match_stems(horizontal_distances, prepare_map(stems)));
}

TEST_CASE("in 4-DoF heights that are off by decimetres do not lose stems, and do not move the rest") {
  for (std::uint64_t seed = 40; seed < 50; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const positions stems = scenes::random_stems(random, 40, 30, 30);
    const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
    positions target = scenes::moved(truth, scenes::noisy(stems, 0.01, random));
    const matching undisturbed = match_stems(stems, target);
    for (std::size_t i = 0; i < target.size(); i += 4)
      target[i].z() += scenes::uniform(random, 0.4, 0.9);  // ground hidden
    const matching result = match_stems(stems, target);
    REQUIRE(result.outcome == outcome::registered);
    CHECK(result.funnel.correspondences >= 36);
    CHECK(result.funnel.correspondences == undisturbed.funnel.correspondences);
    CHECK(result.inlier_threshold < 0.1);
    CHECK(scenes::max_error(*result.target_from_source, truth, stems) < 0.03);
  }
}

TEST_CASE("maps that have nothing in common yield a handful of hypotheses and no transform") {
  random_source random(14);
  const positions one = scenes::random_stems(random, 30, 20, 20),
                  other = scenes::random_stems(random, 30, 20, 20);
  const matching result = match_stems(one, other);
  CHECK(result.outcome == outcome::not_registered);
  CHECK(result.hypotheses.size() <= 16);
  CHECK(result.hypotheses.size() > 1);
}

TEST_CASE("six degrees of freedom and horizontal distances exclude each other") {
  const positions stems(5, Eigen::Vector3d::Zero());
  CHECK_THROWS_WITH(match_stems(stems, stems, {.dof = degrees_of_freedom::six, .horizontal = true}),
                    Catch::Contains("horizontal: six degrees of freedom need heights"));
}

TEST_CASE("scans that were not levelled alike are rotated, unless four degrees of freedom are asked for") {
  for (std::uint64_t seed = 50; seed < 60; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const positions stems = scenes::random_stems(random, 60, 40, 40);
    const Eigen::Vector3d middle(20, 20, 0);
    const Eigen::Isometry3d tilt = Eigen::Translation3d(middle) *
                                   Eigen::AngleAxisd(0.06, Eigen::Vector3d(0.6, 0.8, 0)) *
                                   Eigen::Translation3d(-middle);
    const Eigen::Isometry3d truth = scenes::random_levelled_transform(random) * tilt;
    const positions target = scenes::moved(truth, scenes::noisy(stems, 0.01, random));
    const matching automatic = match_stems(stems, target);
    REQUIRE(automatic.outcome == outcome::registered);
    REQUIRE(automatic.vertical);
    CHECK(automatic.vertical->kind == vertical_kind::rotated);
    CHECK(automatic.vertical->tilt == Approx(0.06).epsilon(0.05));
    CHECK(automatic.uncertainty->covariance.rows() == 6);
    CHECK(scenes::max_error(*automatic.target_from_source, truth, stems) < 0.05);
    const matching four = match_stems(stems, target, {.dof = degrees_of_freedom::four});
    REQUIRE(four.outcome == outcome::registered);
    CHECK(four.vertical->kind == vertical_kind::sloping);
    const matching six = match_stems(stems, target, {.dof = degrees_of_freedom::six});
    REQUIRE(six.outcome == outcome::registered);
    CHECK(scenes::max_error(*six.target_from_source, truth, stems) < 0.05);
  }
}

TEST_CASE("match_stems is as right far from the origin as near it") {
  const Eigen::Isometry3d far_away = scenes::yaw_and_shift(0, {500000, 5300000, 1000});
  random_source random(6);
  const auto views = scenes::half_overlapping_views(random, 40);
  const matching near_result = match_stems(views.source, views.target);
  REQUIRE(near_result.outcome == outcome::registered);
  const positions far_source = scenes::moved(far_away, views.source),
                  far_target = scenes::moved(far_away, views.target);

  const matching both = match_stems(far_source, far_target);
  REQUIRE(both.outcome == outcome::registered);
  const matching one = match_stems(far_source, views.target);
  REQUIRE(one.outcome == outcome::registered);
  for (std::size_t i = 0; i < far_source.size(); ++i) {
    const Eigen::Vector3d expected = *near_result.target_from_source * views.source[i];
    CHECK((*both.target_from_source * far_source[i] - far_away * expected).norm() < 1e-6);
    CHECK((*one.target_from_source * far_source[i] - expected).norm() < 1e-6);
  }
}

TEST_CASE("match_stems turns about the up that it is given") {
  random_source random(7);
  const auto views = scenes::half_overlapping_views(random, 40);
  for (const Eigen::Vector3d& up :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 0, -2), Eigen::Vector3d(1, 2, 3)}) {
    const Eigen::Isometry3d tilt(Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), up));
    const matching result =
        match_stems(scenes::moved(tilt, views.source), scenes::moved(tilt, views.target), {}, up);
    REQUIRE(result.outcome == outcome::registered);
    const Eigen::Isometry3d& transform = *result.target_from_source;
    CHECK((transform.linear() * up).isApprox(up, 1e-12));
    CHECK(scenes::max_error(tilt.inverse() * transform * tilt, views.target_from_source, views.source) <
          0.03);
  }
}

TEST_CASE("maps of up to three stems are not registered, and the reason says so") {
  const positions stems = {{0, 0, 0}, {5, 0, 0}, {1, 4, 0}};
  random_source random(8);
  const positions plenty = scenes::random_stems(random, 20, 20, 20);
  for (std::size_t count = 0; count <= 3; ++count) {
    const positions few(stems.begin(), stems.begin() + std::ptrdiff_t(count));
    for (const auto& [source, target] :
         {std::pair(few, few), std::pair(few, plenty), std::pair(plenty, few)}) {
      const matching result = match_stems(source, target);
      CHECK(result.outcome == outcome::not_registered);
      CHECK_THAT(result.reason, Catch::Contains(std::to_string(count) + " stems"));
      require_coherent(result);
    }
  }
}

TEST_CASE("stems in a line, at one place, or double are no exception and no wrong registration") {
  random_source random(9);
  positions line, doubled = scenes::random_stems(random, 20, 20, 20);
  for (int i = 0; i < 15; ++i)
    line.push_back(scenes::uniform(random, 0, 40) * Eigen::Vector3d(0.6, 0.8, 0.05));
  const positions pile(12, Eigen::Vector3d(1, 2, 3));
  for (const positions& stems : {line, pile}) {
    const matching result = match_stems(stems, stems);
    CHECK(result.outcome != outcome::registered);
    require_coherent(result);
  }
  const positions once = doubled;
  doubled.insert(doubled.end(), once.begin(), once.end());
  const matching result = match_stems(doubled, doubled);
  require_coherent(result);
  REQUIRE(result.outcome == outcome::registered);
  CHECK(scenes::max_error(*result.target_from_source, Eigen::Isometry3d::Identity(), doubled) < 1e-9);
}

TEST_CASE("match_stems names the map and the position that is not finite") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const positions good = {{0, 0, 0}, {5, 0, 0}, {1, 4, 0}}, bad = {{0, 0, 0}, {nan, 0, 0}};
  CHECK_THROWS_AS(match_stems(bad, good), std::invalid_argument);
  CHECK_THROWS_WITH(match_stems(bad, good), Catch::Contains("source: position 1"));
  CHECK_THROWS_WITH(match_stems(good, bad), Catch::Contains("target: position 1"));
}

TEST_CASE("match_stems names the option that makes no sense, whatever the stems") {
  const positions none;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto message_of = [&](const matching_options& options) {
    CHECK_THROWS_AS(match_stems(none, none, options), std::invalid_argument);
    try {
      match_stems(none, none, options);
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  for (const double bad : {0.0, -0.05, nan})
    CHECK_THAT(message_of({.inlier_threshold = bad}), Catch::Contains("inlier_threshold"));
  CHECK_THAT(message_of({.dof = static_cast<degrees_of_freedom>(5)}), Catch::Contains("dof"));
  CHECK_THAT(message_of({.triangles = {.neighbors = 1}}), Catch::Contains("neighbors"));
  CHECK_THAT(message_of({.global = {.max_hypotheses = 0}}), Catch::Contains("max_hypotheses"));
  CHECK_THAT(message_of({.decision = {.min_correspondences = 0}}), Catch::Contains("min_correspondences"));
  CHECK_THROWS_WITH(match_stems(none, none, {}, Eigen::Vector3d(0, 0, 0)), Catch::Contains("up"));
  CHECK_THROWS_WITH(match_stems(none, none, {}, Eigen::Vector3d::UnitZ(), {.threads = -1}),
                    Catch::Contains("threads"));
}

TEST_CASE("match_stems is cancelled by the progress callback at any of its calls") {
  random_source random(10);
  const positions stems = scenes::random_stems(random, 16, 20, 20);
  int calls = 0;
  const auto run = [&](int allowed) {
    calls = 0;
    const execution exec{.threads = 1, .on_progress = [&](const progress& p) {
                           CHECK_FALSE(p.stage.empty());
                           CHECK((p.fraction >= 0 && p.fraction <= 1));
                           return ++calls <= allowed;
                         }};
    return match_stems(stems, stems, {}, Eigen::Vector3d::UnitZ(), exec);
  };
  CHECK(run(std::numeric_limits<int>::max()).outcome == outcome::registered);
  const int all_calls = calls;
  REQUIRE(all_calls > 2);
  for (const int allowed : {0, 1, all_calls / 2, all_calls - 1}) {
    const matching result = run(allowed);
    CHECK(result.outcome == outcome::cancelled);
    CHECK(calls == allowed + 1);
    require_coherent(result);
  }
}

TEST_CASE("the eight rioja pairs are within 1 degree and 0.3 m of their best fits") {
  const std::filesystem::path folder = std::filesystem::path(GLOBALMATCH_SHARED_DATA) / "stem_maps";
  if (!std::filesystem::exists(folder / "rioja_transforms.csv")) {
    WARN("skipped: there is no " << folder.string());
    return;
  }
  const auto references = scenes::read_rioja_transforms(folder / "rioja_transforms.csv");
  REQUIRE(references.size() == 8);
  for (const auto& [plot, reference] : references) {
    INFO("plot " << plot);
    const auto source = support::read_stems(folder / ("rioja_" + plot + "_tls.csv")).stems;
    const auto target = support::read_stems(folder / ("rioja_" + plot + "_field.csv")).stems;
    const matching result = match_stems(source, target, {.horizontal = true, .inlier_threshold = 0.2});
    INFO(result.reason);
    REQUIRE(result.outcome == outcome::registered);
    const Eigen::Isometry3d& transform = *result.target_from_source;
    const double yaw = std::atan2(transform(1, 0), transform(0, 0));
    CHECK(std::abs(std::remainder(yaw - reference.yaw, 2 * std::numbers::pi)) < std::numbers::pi / 180);
    CHECK((transform.translation().head<2>() - reference.shift).norm() < 0.3);
  }
}

TEST_CASE(
    "a given transform is scored as it is: the true one is significant with fewer stems than a search "
    "needs") {
  std::size_t significant = 0, found = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    random_source random(seed);
    const positions stems = scenes::random_stems(random, 36, 60, 30);
    const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
    const positions source(stems.begin(), stems.begin() + 20),
        target =
            scenes::noisy(scenes::moved(truth, positions(stems.begin() + 16, stems.end())), 0.02, random);
    const hypothesis h = score_transform(source, target, truth);
    CHECK(h.target_from_source.matrix() == truth.matrix());
    CHECK(h.correspondences.size() >= 3);
    significant += h.log10_nfa < -3;
    found += match_stems(source, target).outcome == outcome::registered;
    const Eigen::Isometry3d wrong = Eigen::Translation3d(1, -1, 0) * truth;
    CHECK(score_transform(source, target, wrong).log10_nfa > -1);
  }
  CHECK(significant >= 9);
  CHECK(found < significant);
}

TEST_CASE(
    "a given transform is scored in the caller's frames and order, at the threshold that is asked for") {
  random_source random(5);
  const positions target = scenes::random_stems(random, 30, 40, 40);
  const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
  positions source = scenes::moved(truth.inverse(), target);
  std::reverse(source.begin(), source.end());
  const hypothesis h = score_transform(source, target, truth, {.inlier_threshold = 0.3});
  CHECK(h.inlier_threshold == 0.3);
  REQUIRE(h.correspondences.size() == 30);
  for (const correspondence& c : h.correspondences) CHECK(c.source + c.target == 29);
  CHECK(h.rms < 1e-9);
  CHECK(score_transform(source, scenes::noisy(target, 0.01, random), truth).inlier_threshold < 0.1);
}

TEST_CASE("a transform that is not finite, and six degrees of freedom without heights, are refused by name") {
  const positions stems = {{0, 0, 0}, {1, 2, 3}, {4, 1, 1}};
  Eigen::Isometry3d bad = Eigen::Isometry3d::Identity();
  bad.translation().x() = NAN;
  CHECK_THROWS_WITH(score_transform(stems, stems, bad), Catch::Contains("target_from_source"));
  Eigen::Isometry3d mirrored = Eigen::Isometry3d::Identity(), scaled = mirrored;
  mirrored.linear()(0, 0) = -1;
  scaled.linear() *= 1.01;
  for (const Eigen::Isometry3d& wrong : {mirrored, scaled})
    CHECK_THROWS_WITH(score_transform(stems, stems, wrong), Catch::Contains("must be a rotation"));
  const std::vector<Eigen::Vector2d> flat = {{0, 0}, {1, 2}, {4, 1}};
  CHECK_THROWS_WITH(
      score_transform(flat, flat, Eigen::Isometry3d::Identity(), {.dof = degrees_of_freedom::six}),
      Catch::Contains("dof"));
  CHECK(score_transform(positions{}, stems, Eigen::Isometry3d::Identity()).correspondences.empty());
}

}  // namespace globalmatch::test_stem_matching

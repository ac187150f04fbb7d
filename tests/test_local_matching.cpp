#include "globalmatch/local_matching.hpp"

#include <cmath>
#include <limits>

#include "catch.hpp"
#include "oracles/brute_force_local_matching.hpp"
#include "position_types.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_local_matching {

using namespace detail;

using scenes::positions;

namespace {

triangle with_edges(double a, double b, double c, stem_index first_vertex = 0) {
  return {{first_vertex, first_vertex + 1, first_vertex + 2}, {a, b, c}};
}

void require_same(const std::vector<triangle_pair>& a, const std::vector<triangle_pair>& b) {
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    CHECK(a[i].source == b[i].source);
    CHECK(a[i].target == b[i].target);
    CHECK(a[i].dissimilarity == b[i].dissimilarity);
  }
}

/// The same but for a choice among equally similar source triangles. These are common: when all edges of one
/// triangle are the longer ones, no order of its vertices is more similar than another.
void require_as_similar(const std::vector<triangle_pair>& a, const std::vector<triangle_pair>& b) {
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    CHECK(a[i].target == b[i].target);
    CHECK(a[i].dissimilarity == Approx(b[i].dissimilarity).margin(1e-12));
  }
}

/// Edges of the source triangle of a pair, in the order of the pair's vertices.
std::array<double, 3> source_edges(const triangle_pair& pair, const position_set& stems) {
  const auto& v = pair.source;
  return {stem_distance(stems.at[v[1]], stems.at[v[2]], true),
          stem_distance(stems.at[v[2]], stems.at[v[0]], true),
          stem_distance(stems.at[v[0]], stems.at[v[1]], true)};
}

}  // namespace

TEST_CASE("local_dissimilarity is the sum of the differences of corresponding edges, Eq. 4") {
  CHECK(local_dissimilarity(with_edges(8, 6, 5), with_edges(8.25, 5.875, 5), 0.5) == 0.375);
  CHECK(local_dissimilarity(with_edges(8, 6, 5), with_edges(8, 6, 5), 0.5) == 0.0);
}

TEST_CASE("local_dissimilarity wants every difference strictly below the tolerance") {
  for (std::size_t edge = 0; edge < 3; ++edge)
    for (const double sign : {1.0, -1.0}) {
      triangle other = with_edges(8, 6, 5);
      other.edges[edge] += sign * 0.5;
      CHECK(std::isinf(local_dissimilarity(with_edges(8, 6, 5), other, 0.5)));
      CHECK(local_dissimilarity(with_edges(8, 6, 5), other, std::nextafter(0.5, 1)) == 0.5);
    }
}

TEST_CASE("match_locally wants differences strictly below the tolerance") {
  const std::vector<triangle> source = {with_edges(8, 6, 4)};
  CHECK(match_locally(source, {with_edges(8.5, 6, 4)}, 0.5).empty());
  CHECK(match_locally(source, {with_edges(7.5, 6, 4)}, 0.5).empty());
  CHECK(match_locally(source, {with_edges(8.5, 6, 4)}, std::nextafter(0.5, 1)).size() == 1);
  CHECK(match_locally(source, {with_edges(7.5, 6, 4)}, std::nextafter(0.5, 1)).size() == 1);
}

TEST_CASE("match_locally equals brute force for positions of any type") {
  random_source random(1);
  const positions source = scenes::random_stems(random, 15, 12, 12);
  const position_set target_set = scenes::set_in_order(scenes::noisy(source, 0.05, random));
  const auto target_triangles = build_triangles(target_set, true, {.neighbors = 5});
  for (const double epsilon : {0.01, 0.05, 0.3, 2.0}) {
    const auto check = [&](const char* name, const auto& range) {
      INFO(name << ", tolerance " << epsilon);
      const position_set source_set = import_positions(range, Eigen::Vector3d::UnitZ(), "source");
      const auto source_triangles = build_triangles(source_set, true, {.neighbors = 5});
      const auto pairs = match_locally(source_triangles, target_triangles, epsilon);
      require_as_similar(
          pairs, oracles::brute_force_pairs(source_set, source_triangles, target_triangles, true, epsilon));
      for (const triangle_pair& pair : pairs) {
        CHECK(oracles::is_admissible(source_set, pair.source, true, epsilon));
        const triangle target = make_triangle(target_set, pair.target, true);
        const auto d = oracles::dissimilarity(source_edges(pair, source_set), target.edges, epsilon);
        REQUIRE(d);
        CHECK(*d == Approx(pair.dissimilarity).margin(1e-12));
      }
    };
    scenes::for_each_type_with_heights(source, check);
    scenes::for_each_type_without_heights(source, check);
  }
}

TEST_CASE("match_locally gives each target triangle one partner at most, the most similar, in their order") {
  random_source random(2);
  const position_set source = scenes::set_in_order(scenes::random_stems(random, 30, 20, 20));
  const position_set target = scenes::set_in_order(scenes::noisy(scenes::positions_of(source), 0.02, random));
  const auto source_triangles = build_triangles(source, false, {.neighbors = 8});
  const auto target_triangles = build_triangles(target, false, {.neighbors = 8});
  const auto pairs = match_locally(source_triangles, target_triangles, 0.05);
  CHECK(pairs.size() > target_triangles.size() / 4);
  auto next = target_triangles.begin();
  for (const triangle_pair& pair : pairs) {
    next = std::find_if(next, target_triangles.end(),
                        [&](const triangle& t) { return t.vertices == pair.target; });
    REQUIRE(next != target_triangles.end());
    CHECK(std::none_of(source_triangles.begin(), source_triangles.end(), [&](const triangle& s) {
      return local_dissimilarity(s, *next, 0.05) < pair.dissimilarity;
    }));
    ++next;
  }
}

TEST_CASE("of equally similar source triangles match_locally takes the first") {
  const std::vector<triangle> target = {with_edges(8, 6, 4)};
  const triangle longer = with_edges(8.25, 6, 4, 10), shorter = with_edges(7.75, 6, 4, 20),
                 same = with_edges(8.25, 6, 4, 30);
  const auto partner = [&](const std::vector<triangle>& source) {
    const auto pairs = match_locally(source, target, 0.5);
    REQUIRE(pairs.size() == 1);
    return pairs.front().source[0];
  };
  CHECK(partner({longer, same}) == 10);
  CHECK(partner({same, longer}) == 30);
  CHECK(partner({shorter, longer}) == 20);
  CHECK(partner({longer, shorter}) == 10);
}

TEST_CASE("match_locally pairs each stem of an unchanged map with itself") {
  random_source random(3);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 30, 20, 20));
  const auto triangles = build_triangles(stems, false);
  const auto pairs = match_locally(triangles, triangles, 0.05);
  REQUIRE(pairs.size() == triangles.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    CHECK(pairs[i].source == triangles[i].vertices);
    CHECK(pairs[i].target == triangles[i].vertices);
    CHECK(pairs[i].dissimilarity == 0);
  }
}

TEST_CASE("match_locally does not pair mirrored triangles") {
  const position_set stems = scenes::set_in_order({{0, 0, 0}, {5, 0, 0}, {2, 3, 0}});
  const position_set mirrored = scenes::set_in_order({{0, 0, 0}, {-5, 0, 0}, {-2, 3, 0}});
  CHECK(match_locally(build_triangles(stems, false), build_triangles(mirrored, false), 0.05).empty());
  CHECK(match_locally(build_triangles(stems, false), build_triangles(stems, false), 0.05).size() == 1);
}

TEST_CASE("match_locally finds no pairs where there are no triangles") {
  const std::vector<triangle> one = {with_edges(8, 6, 4)};
  CHECK(match_locally({}, {}, 0.05).empty());
  CHECK(match_locally(one, {}, 0.05).empty());
  CHECK(match_locally({}, one, 0.05).empty());
}

TEST_CASE("match_locally gives the same bits for any number of threads") {
  random_source random(4);
  const position_set source = scenes::set_in_order(scenes::random_stems(random, 60, 20, 20));
  const position_set target = scenes::set_in_order(scenes::noisy(scenes::positions_of(source), 0.02, random));
  const auto source_triangles = build_triangles(source, false),
             target_triangles = build_triangles(target, false);
  REQUIRE(target_triangles.size() > 2048);
  const auto expected = match_locally(source_triangles, target_triangles, 0.05, {.threads = 1});
  for (const int threads : {2, 8})
    require_same(match_locally(source_triangles, target_triangles, 0.05, {.threads = threads}), expected);
}

TEST_CASE("match_locally refuses an epsilon that is not positive") {
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    CHECK_THROWS_AS(match_locally({}, {}, bad), std::invalid_argument);
    CHECK_THROWS_WITH(match_locally({}, {}, bad), Catch::Contains("epsilon must be positive"));
  }
}

TEST_CASE("match_locally stops when the progress callback says so") {
  const std::vector<triangle> one = {with_edges(8, 6, 4)};
  const execution exec{.threads = 1, .on_progress = [](const progress&) { return false; }};
  CHECK_THROWS_AS(match_locally(one, one, 0.05, exec), operation_cancelled);
}

TEST_CASE("match_locally loses no pair to rounding where edges are long") {
  constexpr double epsilon = 0.05;
  random_source random(31);
  for (int i = 0; i < 500; ++i) {
    const double a = scenes::uniform(random, 900, 1000), b = scenes::uniform(random, 700, 800),
                 c = scenes::uniform(random, 500, 600), off = epsilon * (1 - 1e-9);
    const auto pairs = match_locally({with_edges(a, b, c)}, {with_edges(a + off, b - off, c + off)}, epsilon);
    CHECK(pairs.size() == 1);
  }
}

}  // namespace globalmatch::test_local_matching

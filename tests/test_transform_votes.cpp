#include "globalmatch/detail/matching/transform_votes.hpp"

#include <array>
#include <cstddef>
#include <numbers>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_transform_votes {

using namespace detail;

using scenes::four;

TEST_CASE("transforms that most triangles vote for are tried first, each once") {
  random_source random(9);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 30, 20, 20));
  const matching_context maps(stems, stems, true, four);
  vote_accumulator votes(maps);
  const auto cast = [&](const std::array<stem_index, 3>& asked, const std::array<stem_index, 3>& like) {
    votes.set_query(triangle{asked, {}}, 0);
    votes.vote(like);
  };
  votes.reset(0.01);
  cast({0, 3, 4}, {9, 7, 8});
  for (stem_index k = 1; k < 5; ++k) cast({0, k, k + 1}, {0, k, k + 1});  // in place, of any shape
  const auto peaks_end = votes.peaks(10);
  REQUIRE(peaks_end.size() == 2);
  CHECK(peaks_end[0] == std::array<correspondence, 3>{{{0, 0}, {4, 4}, {5, 5}}});
  CHECK(peaks_end[1] == std::array<correspondence, 3>{{{0, 9}, {3, 7}, {4, 8}}});
  CHECK(votes.peaks(1).size() == 1);
  votes.reset(0.01);
  CHECK(votes.peaks(10).empty());
}

TEST_CASE(
    "triangles whose transform is the same vote together, whichever of their vertices is the common stem") {
  random_source random(91);
  const scenes::positions stems = scenes::random_stems(random, 30, 20, 14);
  const position_set source = scenes::set_in_order(stems);
  for (const double yaw : {-2.9, -1.1, 0.4, 2.0}) {
    CAPTURE(yaw);
    const position_set target =
        scenes::set_in_order(scenes::moved(scenes::yaw_and_shift(yaw, {30, -20, 2}), stems));
    const matching_context maps(source, target, false, four);
    vote_accumulator votes(maps);
    votes.reset(0.02);
    const auto cast = [&](const std::array<stem_index, 3>& asked, const std::array<stem_index, 3>& like) {
      votes.set_query(triangle{asked, {}}, 5);
      votes.vote(like);
    };
    cast({5, 1, 2}, {5, 1, 2});
    cast({3, 5, 4}, {3, 5, 4});
    cast({6, 7, 5}, {6, 7, 5});
    for (stem_index k = 10; k < 24; ++k) cast({5, k, k + 1}, {5, k + 1, k});       // half a turn off
    for (stem_index k = 10; k < 24; ++k) cast({5, k, k + 1}, {k - 10, k, k + 1});  // each onto another stem
    const auto peaks = votes.peaks(2);
    REQUIRE(peaks.size() == 2);
    CHECK(peaks[0] == std::array<correspondence, 3>{{{5, 5}, {23, 24}, {24, 23}}});
    // Three, and the one of the last that is onto stem 5 itself.
    CHECK(peaks[1] == std::array<correspondence, 3>{{{5, 5}, {15, 15}, {16, 16}}});
  }
}

TEST_CASE(
    "votes count as one where their yaws are equal, and not where they are further apart than asked for") {
  random_source random(92);
  for (const double width : {0.3, 0.05}) {
    position_set source = scenes::set_in_order({{0, 0, 0}, {3, 1, 0}, {-2, 5, 0}}), target = source;
    const matching_context maps(source, target, true, four);
    vote_accumulator votes(maps);
    const auto together = [&](double first, double second) {
      votes.reset(width);
      for (const double yaw : {first, second}) {
        votes.set_query(triangle{{0, 1, 2}, {}}, 0);
        for (stem_index i = 0; i < 3; ++i) target.at[i] = rotation_about_z(yaw) * source.at[i];
        votes.vote({0, 1, 2});
      }
      return votes.peaks(9).size() == 1;
    };
    for (int i = 0; i < 500; ++i) {
      const double yaw = scenes::uniform(random, -3.14, 3.14);
      const double apart = scenes::uniform(random, 1.35 * width, std::numbers::pi);
      CHECK_FALSE(together(yaw, yaw + apart));
      CHECK_FALSE(together(yaw, yaw - apart));
      CHECK(together(yaw, yaw));
    }
  }
}

TEST_CASE("the common stem is looked for at each vertex of the triangle that is asked for") {
  random_source random(93);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 30, 20, 14));
  const matching_context maps(stems, stems, true, four);
  using vertices = std::array<stem_index, 3>;
  const auto peaks_of = [&](const vertices& first, const vertices& second, const vertices& second_like) {
    vote_accumulator votes(maps);
    votes.reset(0.01);
    votes.set_query(triangle{first, {}}, 5);
    votes.vote(first);
    votes.set_query(triangle{second, {}}, 5);
    votes.vote(second_like);
    return votes.peaks(9).size();
  };
  for (const vertices& asked : {vertices{5, 8, 9}, vertices{8, 5, 9}, vertices{8, 9, 5}}) {
    CHECK(peaks_of({5, 1, 2}, asked, asked) == 1);
    CHECK(peaks_of({1, 2, 5}, asked, asked) == 1);
    vertices other = asked;  // of the same direction, but onto another stem
    if (asked[0] == 5) {
      other[0] = 4;
      CHECK(peaks_of({5, 1, 2}, asked, other) == 2);
    }
  }
}

TEST_CASE("a width of more than a turn leaves the stem alone to distinguish, one of zero is borne") {
  const position_set stems = scenes::set_in_order({{0, 0, 0}, {4, 0, 0}, {0, 3, 0}, {9, 9, 0}});
  const matching_context maps(stems, stems, true, four);
  vote_accumulator votes(maps);
  for (const double width : {10.0, 0.0}) {
    votes.reset(width);
    votes.set_query(triangle{{0, 1, 2}, {}}, 0);
    votes.vote({0, 1, 2});
    votes.vote({0, 2, 1});
    votes.vote({3, 1, 2});
    CHECK(votes.peaks(9).size() == (width > 7 ? 2u : 3u));
  }
}

}  // namespace globalmatch::test_transform_votes

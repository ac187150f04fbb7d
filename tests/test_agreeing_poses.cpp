#include "globalmatch/detail/survey/agreeing_poses.hpp"

#include <optional>
#include <vector>

#include "catch.hpp"

namespace globalmatch::detail::test_agreeing_poses {

namespace {

/// Four maps in a row of 20 m, solved to a centimetre, whose places are known but for an error of the last.
struct row_of_maps {
  std::vector<prepared_stems> maps{4};
  adjusted_survey adjusted;
  survey_heights heights;
  std::vector<std::optional<rigid>> places{4};

  explicit row_of_maps(const rigid& error) {
    for (std::size_t m = 0; m < 4; ++m) {
      maps[m].stems.at = {{4, 0, 0}, {-2, 3, 1}, {-2, -3, -1}};
      adjusted.poses.push_back({{20.0 * double(m), 0}, 0.2 * double(m)});
      adjusted.covariance.push_back(mat3::diagonal_of({1e-4, 1e-4, 1e-6}));
      heights.of_map.push_back(0.5 * double(m));
      heights.sigma.push_back(0.01);
      heights.known.push_back(true);
      places[m] = in_space(adjusted.poses[m], heights.of_map[m]);
    }
    places[3] = *places[3] * error;
  }
};

}  // namespace

TEST_CASE("known poses that agree are held, and one that is off in any way is let go with its distance") {
  const rigid errors[] = {{mat3::identity(), {0.5, 0, 0}},
                          {mat3::identity(), {0, 0, 0.3}},
                          {rotation_about_z(0.1), {}},
                          {rotation_about({1, 0, 0}, 0.05), {}}};
  for (const rigid& error : errors) {
    const row_of_maps row(error);
    known_poses known(known_poses::none, row.places);
    std::vector<double> distances(4, -1);
    const known_pose_comparison compare(row.maps, row.adjusted, row.heights, known);
    CHECK(compare(0, 0).agrees);
    CHECK(compare(1, 2).agrees);
    CHECK_FALSE(compare(0, 3).agrees);
    CHECK(hold_agreeing(compare, {{3, 0, 1, 2}}, known, distances));
    for (std::size_t m = 0; m < 4; ++m) CHECK(known.is_fixed(m) == (m < 3));
    CHECK(known.rank(0) > known.rank(3));
    CHECK(distances[0] == -1);
    CHECK(distances[3] >= 0);
  }
}

TEST_CASE("one known pose of a component changes nothing, and heights that are not known do not count") {
  row_of_maps row({mat3::identity(), {0, 0, 5}});
  known_poses known(known_poses::none, row.places);
  std::vector<double> distances(4, -1);
  const known_pose_comparison compare(row.maps, row.adjusted, row.heights, known);
  CHECK_FALSE(hold_agreeing(compare, {{0}, {1}, {2}, {3}}, known, distances));
  CHECK_FALSE(known.is_fixed(0));
  row.heights.known[3] = false;
  CHECK(compare(0, 3).agrees);
}

}  // namespace globalmatch::detail::test_agreeing_poses

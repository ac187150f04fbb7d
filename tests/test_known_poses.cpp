#include "globalmatch/detail/survey/known_poses.hpp"

#include <optional>
#include <vector>

#include "catch.hpp"

namespace globalmatch::detail::test_known_poses {

TEST_CASE(
    "known poses come before the preferred one, the one referred to before all, and none is held at first") {
  std::vector<std::optional<rigid>> places(4);
  places[1] = rigid{rotation_about_z(0.3), {1, 2, 3}};
  places[3] = rigid{rotation_about_z(1.1), {5, -2, 4}};
  known_poses known(2, places);
  for (std::size_t m = 0; m < 4; ++m) {
    CHECK(known.is_known(m) == (m % 2 == 1));
    CHECK_FALSE(known.is_fixed(m));
  }
  CHECK_FALSE(known.is_known(9));
  CHECK(known.rank(0) < known.rank(2));
  CHECK(known.rank(2) < known.rank(1));
  CHECK(known.rank(1) == known.rank(3));
  known.note_level(0);
  CHECK(known.rank(0) > 0);
  CHECK(known.rank(0) < known.rank(2));
  known.refer_to(3);
  CHECK(known.rank(1) < known.rank(3));
  known.hold(1);
  CHECK(known.is_fixed(1));
  known.release_all();
  CHECK_FALSE(known.is_fixed(1));
  CHECK_FALSE(known_poses(5).is_known(5));
  CHECK(known_poses(5).rank(5) > known_poses(5).rank(4));
}

TEST_CASE("a known pose beside another one is that from its own local frame to the other's") {
  std::vector<std::optional<rigid>> places(2);
  places[0] = rigid{rotation_about_z(0.3), {1, 2, 3}};
  places[1] = rigid{rotation_about_z(1.1), {5, -2, 4}};
  const known_poses known(known_poses::none, places);
  const vec3 p = {7, 8, 9};
  CHECK((*places[0] * (known.transform_beside(0, 1) * p) - *places[1] * p).norm() < 1e-12);
}

}  // namespace globalmatch::detail::test_known_poses

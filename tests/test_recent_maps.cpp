#include "globalmatch/detail/survey/recent_maps.hpp"

#include <vector>

#include "catch.hpp"

namespace globalmatch::test_recent_maps {

using namespace detail;

TEST_CASE("maps that were asked for lately are loaded once, and others again") {
  std::vector<std::size_t> loaded;
  const auto load = [&](std::size_t m) {
    loaded.push_back(m);
    stem_map map;
    map.spacing_near = double(m);
    return map;
  };
  recent_maps maps(load);
  for (std::size_t m = 0; m < 8; ++m) CHECK(maps(m)->spacing_near == double(m));
  CHECK(maps(0)->spacing_near == 0);
  CHECK(loaded.size() == 8);
  const auto kept = maps(1);  // by who asked for it, whatever is loaded later
  for (std::size_t m = 8; m < 20; ++m) CHECK(maps(m)->spacing_near == double(m));
  CHECK(loaded.size() == 20);
  CHECK(kept->spacing_near == 1);
  CHECK(maps(0)->spacing_near == 0);
  CHECK(loaded.size() == 21);
}

}  // namespace globalmatch::test_recent_maps

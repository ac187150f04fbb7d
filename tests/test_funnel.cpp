#include "globalmatch/stem_map.hpp"

#include "catch.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/stem_mapping.hpp"

namespace globalmatch {

using namespace detail;

TEST_CASE("the step that lost the stems is the first that leaves nothing, or else too little") {
  const auto step = [](std::string_view name, std::size_t in, std::size_t out) {
    return funnel_step{name, "clusters", in, "cylinders", out, "not like a stem", "scan nearer"};
  };
  CHECK(where_lost({step("a", 100, 50), step("b", 50, 3), step("c", 3, 0)}, 4) ==
        "c: 0 cylinders of 3 clusters; scan nearer");
  CHECK(where_lost({step("a", 100, 50), step("b", 50, 3), step("c", 3, 2)}, 4) ==
        "b: 3 cylinders of 50 clusters; scan nearer");
  CHECK(where_lost({step("a", 100, 50)}, 4).empty());
  CHECK(where_lost({}, 4).empty());
}

TEST_CASE("the funnels hang together: what a step is given is what an earlier one left") {
  mapping_funnel f;
  f.ground.points = 1000;
  f.ground.not_finite = 10;
  f.understory = 300;
  f.thinned = 200;
  f.stem_points = 50;
  f.clusters = 9;
  f.cylinders = 7;
  f.stems = 6;
  const auto steps = explain(f);
  REQUIRE(steps.size() == 8);
  CHECK(steps.front().in == 1000);
  CHECK(steps.back().out == 6);
  for (std::size_t i = 3; i < steps.size(); ++i) CHECK(steps[i].in == steps[i - 1].out);
  for (const funnel_step& s : steps) {
    CHECK(!s.rest.empty());
    CHECK(!s.remedy.empty());
  }

  CHECK(steps[3].what == "cells");
  f.by_cells = false;
  CHECK(explain(f)[3].what == "thinned points");

  matching_funnel m;
  m.source_stems = 20;
  m.target_stems = 30;
  m.correspondences = 12;
  CHECK(explain(m).back().in == 20);
  CHECK(explain(m).back().out == 12);
}

}  // namespace globalmatch

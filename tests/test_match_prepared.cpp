#include "globalmatch/detail/verbs/match_prepared.hpp"

#include <utility>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_match_prepared {

using namespace detail;

TEST_CASE("a hypothesis returns to the caller's frames and indices, in their order") {
  random_source random(1);
  const scenes::positions stems = scenes::random_stems(random, 9, 30, 30);
  const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
  const position_set source = import_positions(stems, Eigen::Vector3d::UnitZ(), "source"),
                     target =
                         import_positions(scenes::moved(truth, stems), Eigen::Vector3d::UnitZ(), "target");
  local_hypothesis h;
  h.target_from_source =
      target.frame.local_from_scan() * from_eigen(truth) * source.frame.local_from_scan().inverse();
  for (stem_index s = 0; s < 9; ++s)
    for (stem_index t = 0; t < 9; ++t)
      if (source.original[s] == target.original[t]) h.correspondences.push_back({s, t});
  const hypothesis returned = in_caller_frames(std::move(h), source, target);
  CHECK(scenes::max_error(returned.target_from_source, truth, stems) < 1e-9);
  REQUIRE(returned.correspondences.size() == 9);
  for (stem_index i = 0; i < 9; ++i) CHECK(returned.correspondences[i] == correspondence{i, i});
}

TEST_CASE("alternatives that are not significant go, but for the next best one") {
  std::vector<local_hypothesis> hypotheses(5);
  const double log10_nfa[] = {-9, 1, -5, 2, -4};
  for (std::size_t i = 0; i < 5; ++i)
    hypotheses[i].log10_nfa = hypotheses[i].log10_nfa_poisson = log10_nfa[i];
  remove_insignificant(hypotheses, {});
  REQUIRE(hypotheses.size() == 4);
  CHECK(hypotheses[1].log10_nfa == 1);
  CHECK(hypotheses[2].log10_nfa == -5);
  CHECK(hypotheses[3].log10_nfa == -4);
}

}  // namespace globalmatch::test_match_prepared

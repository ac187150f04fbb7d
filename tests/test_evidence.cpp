#include "globalmatch/detail/matching/evidence.hpp"

#include "catch.hpp"

namespace globalmatch::test_evidence {

using namespace detail;

TEST_CASE("evidence of another kind counts where it is significant and the smaller NFA") {
  const auto combined = [](double own, double other) {
    local_hypothesis h;
    h.log10_nfa = own;
    h.log10_nfa_poisson = -9;
    combine(h, {other, evidence_source::gaps});
    return h;
  };
  CHECK(combined(-1, -3).log10_nfa == -3);
  CHECK(combined(-1, -3).evidence == evidence_source::gaps);
  CHECK(combined(-4, -3).log10_nfa == -4);
  CHECK(combined(-4, -3).evidence == evidence_source::positions);
  CHECK(combined(3, -1.9).log10_nfa == 3);
}

TEST_CASE("combining evidence changes the NFA and its source, and nothing else") {
  local_hypothesis h;
  h.log10_nfa = -1;
  h.log10_nfa_poisson = -5.5;
  h.rms = 0.04;
  h.correspondences = {{0, 1}, {1, 0}};
  combine(h, {-3, evidence_source::radii, -9});
  CHECK(h.evidence == evidence_source::radii);
  CHECK(h.log10_nfa == -3);
  CHECK(h.log10_nfa_poisson == -5.5);
  CHECK(h.rms == 0.04);
  CHECK(h.correspondences.size() == 2);
  combine(h, {-3, evidence_source::gaps});  // no smaller
  CHECK(h.evidence == evidence_source::radii);
}

TEST_CASE("evidence of another kind is significant below an NFA of 0.01, not at it") {
  local_hypothesis h;
  h.log10_nfa_poisson = -9;
  combine(h, {-2, evidence_source::residuals});
  CHECK(h.evidence == evidence_source::positions);
  CHECK(h.log10_nfa == 0);
  combine(h, {-2.001, evidence_source::residuals});
  CHECK(h.evidence == evidence_source::residuals);
}

TEST_CASE("evidence of another kind is worth no more than the alignment of the lattices by positions") {
  local_hypothesis h;
  h.log10_nfa = 2;
  h.log10_nfa_poisson = 1;
  combine(h, {-8, evidence_source::residuals});
  CHECK(h.evidence == evidence_source::positions);
  CHECK(h.log10_nfa == 2);
  h.log10_nfa_poisson = -4;
  combine(h, {-8, evidence_source::residuals});
  CHECK(h.evidence == evidence_source::residuals);
  CHECK(h.log10_nfa == -4);
}

}  // namespace globalmatch::test_evidence

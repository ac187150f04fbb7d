// Stem maps of any kind: a matching that is coherent, or `std::invalid_argument` for what is not finite.
#include <optional>
#include <stdexcept>

#include "fuzz_input.hpp"
#include "globalmatch/stem_matching.hpp"

using namespace globalmatch;

namespace {

/// The other map: parts of the first one, transformed, among other stems.
std::vector<Eigen::Vector3d> second_map(const std::vector<Eigen::Vector3d>& first, fuzz::byte_source& bytes) {
  const double yaw = bytes.take<std::uint16_t>() / 1000.0;
  const Eigen::Isometry3d transform =
      Eigen::Translation3d(bytes.position()) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
  std::vector<Eigen::Vector3d> second = bytes.positions(48);
  for (const Eigen::Vector3d& p : first)
    if (bytes.choice(4) != 0)
      second.push_back(transform * p +
                       0.001 * Eigen::Vector3d(bytes.take<std::int8_t>(), bytes.take<std::int8_t>(), 0));
  return second;
}

void require_coherent(const matching& m, std::size_t sources, std::size_t targets) {
  fuzz::require((m.outcome == outcome::registered) == m.target_from_source.has_value(),
                "a transform, or none");
  fuzz::require((m.outcome == outcome::registered) == m.reason.empty(), "a reason, or none");
  fuzz::require(m.probability >= 0 && m.probability <= 1, "the probability is one");
  for (const hypothesis& h : m.hypotheses) {
    fuzz::require(h.target_from_source.matrix().allFinite(), "transforms are finite");
    std::vector<bool> source_taken(sources), target_taken(targets);
    for (const correspondence& c : h.correspondences) {
      fuzz::require(c.source < sources && c.target < targets, "pairs name stems");
      fuzz::require(!source_taken[c.source] && !target_taken[c.target], "pairs are one to one");
      source_taken[c.source] = target_taken[c.target] = true;
    }
  }
  if (m.uncertainty) fuzz::require(m.uncertainty->covariance.allFinite(), "the covariance is finite");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::byte_source bytes(data, size);
  matching_options options;
  if (const auto dof = bytes.choice(4); dof < 2)
    options.dof = dof == 0 ? degrees_of_freedom::six : degrees_of_freedom::four;
  options.horizontal = options.dof != degrees_of_freedom::six && bytes.choice(4) == 0;
  options.proposal = bytes.choice(4) == 0 ? proposal::algorithm_1 : proposal::triangle_index;
  if (bytes.choice(2) == 0) options.inlier_threshold = 0.02 + bytes.take<std::uint8_t>() / 100.0;
  options.global.max_hypotheses = 4;
  const auto source = bytes.positions(48), target = second_map(source, bytes);
  try {
    const matching m = match_stems(source, target, options, Eigen::Vector3d::UnitZ(), {.threads = 1});
    require_coherent(m, source.size(), target.size());
  } catch (const std::invalid_argument&) {
    bool good = true;
    for (const auto* map : {&source, &target})
      for (const Eigen::Vector3d& p : *map) good = good && p.allFinite() && p.cwiseAbs().maxCoeff() <= 1e12;
    const bool may_lack_heights = options.dof == degrees_of_freedom::six;  // where all z are equal
    fuzz::require(!good || may_lack_heights,
                  "only positions that are not finite, or as far as no plot, are refused");
  }
  return 0;
}

// How exactly each map of a survey shows its stems: a field census and a scan may differ tenfold. In: links.
// Out: a standard deviation in plan for each map.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/matching.hpp"

namespace globalmatch::detail {

inline constexpr double min_stem_deviation = 1e-4;  // [m]
/// [m] Of stems of scans, where no link by stems says it.
inline constexpr double usual_stem_deviation = 0.03;

/// Sum of the variances [m^2] of stems along each axis, of both maps of a link, from the median distance of
/// the stems that it pairs: some are off by much more, as those seen from two sides, and lose their weight
/// later. Residuals are as many fewer as the transform has parameters.
inline double sum_of_variances(std::span<const prepared_stems> maps, const survey_link& l) {
  constexpr double median_of_chi_squared = 1.386;  // of two degrees of freedom
  std::vector<double> squares;
  for (const correspondence& c : l.correspondences)
    squares.push_back((l.target_from_source * maps[l.source].stems.at[c.source].xy() -
                       maps[l.target].stems.at[c.target].xy())
                          .squared_norm());
  const double pairs = std::max(2.0, double(squares.size()));
  return median(squares) / median_of_chi_squared * pairs / (pairs - 1.5);
}

/// A variance [m^2] of stems of a map, as a link to another map tells it.
struct shared_variance {
  std::uint32_t neighbor;
  double sum;  ///< of the variances of both maps
};

/// A link with that sum, and the number of its pairs.
struct link_variance {
  std::uint32_t source, target;
  double sum;
  double pairs;
  bool is_supported = true;  ///< by a cycle
};

/// The variance of each map, of which links tell sums: halfway to the median of what its links say, again and
/// again, since two maps would exchange theirs for ever.
inline std::vector<double> separate_variances(std::span<const std::vector<shared_variance>> of_links,
                                              double typical) {
  constexpr int iterations = 20;
  constexpr double min_share = 0.05;  // of a sum, that one of its maps has
  std::vector<double> variance(of_links.size(), typical), next = variance, own;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    for (std::size_t m = 0; m < of_links.size(); ++m) {
      if (of_links[m].empty()) continue;
      own.clear();
      for (const shared_variance& l : of_links[m])
        own.push_back(std::max(min_share * l.sum, l.sum - variance[l.neighbor]));
      next[m] = (variance[m] + median(own)) / 2;
    }
    std::swap(variance, next);
  }
  return variance;
}

/// Raises the variances of two maps that agree worse than those say that they should, significantly: maps
/// that repeat each other's errors, as extracts of one census do, seem exact until another one is beside
/// them. A link that no cycle supports, and that may be wrong, raises no map that has others.
inline void raise_to_links(std::span<const link_variance> links, std::span<double> variances) {
  constexpr double deviations = 3;
  const std::vector<double> before(variances.begin(), variances.end());
  std::vector<bool> has_supported(variances.size(), false);
  for (const link_variance& l : links)
    if (l.is_supported) has_supported[l.source] = has_supported[l.target] = true;
  for (const link_variance& l : links) {
    const double expected = before[l.source] + before[l.target];
    if (l.sum * (1 - deviations / std::sqrt(l.pairs)) <= expected) continue;
    for (const std::uint32_t m : {l.source, l.target})
      if (l.is_supported || !has_supported[m])
        variances[m] = std::max(variances[m], before[m] + (l.sum - expected) / 2);
  }
}

/// Standard deviations [m] of stems along each axis, each map's, from the distances of the stems that links
/// pair. Where links do not tell which of two maps is the noisier one both are taken for equal. Maps that do
/// not differ significantly from most have the same deviation (positive-part estimator of James and Stein
/// 1961, Proc. 4th Berkeley Symposium 1, on logarithms), as those without links.
inline std::vector<double> deviations_of_maps(std::span<const link_variance> links, std::size_t maps) {
  constexpr double least = min_stem_deviation * min_stem_deviation, deviations = 3;
  constexpr double variance_of_log = 8;  // times the pairs: medians, of differences to neighbors
  std::vector<std::vector<shared_variance>> of_links(maps);
  std::vector<double> pairs(maps, 0), all;  // of stems
  for (const link_variance& l : links) {
    const double sum = std::max(2 * least, l.sum);  // of maps that agree to the bit
    of_links[l.source].push_back({l.target, sum});
    of_links[l.target].push_back({l.source, sum});
    for (const std::uint32_t m : {l.source, l.target}) pairs[m] += l.pairs;
    all.push_back(sum / 2);
  }
  std::vector<double> variances = separate_variances(of_links, all.empty() ? least : median(all));
  raise_to_links(links, variances);
  all.clear();
  for (std::size_t m = 0; m < maps; ++m)
    if (!of_links[m].empty()) all.push_back(variances[m]);
  const double most = std::log(all.empty() ? least : median(all));
  std::vector<double> found(maps, std::exp(most / 2));
  for (std::size_t m = 0; m < maps; ++m) {
    if (!(pairs[m] > 0)) continue;
    const double off = std::log(std::max(least, variances[m])) - most;
    const double at_random = deviations * deviations * variance_of_log / pairs[m];
    const double share = std::max(0.0, 1 - at_random / std::max(at_random, off * off));
    found[m] = std::exp((most + share * off) / 2);
  }
  return found;
}

/// The same from the links that are used; the usual ones where only targets link maps.
inline std::vector<double> deviations_by_links(std::span<const prepared_stems> maps,
                                               std::span<const survey_link> links) {
  std::vector<link_variance> variances;
  for (const survey_link& l : links)
    if (l.used && !l.correspondences.empty())
      variances.push_back({l.source, l.target, sum_of_variances(maps, l), double(l.correspondences.size()),
                           l.supporting_cycles > 0});
  const bool has_others = std::any_of(links.begin(), links.end(), [](const auto& l) { return l.used; });
  if (variances.empty() && has_others) return std::vector<double>(maps.size(), usual_stem_deviation);
  return deviations_of_maps(variances, maps.size());
}

}  // namespace globalmatch::detail

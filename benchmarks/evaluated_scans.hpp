// Scans mapped for an evaluation, and their stem maps scored by the true stems.
#pragma once

#include <globalmatch/evaluation.hpp>
#include <globalmatch/stem_mapping.hpp>

#include "support/programs/reports.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

/// Returns in the scan of a true stem: of one that a find may be, and of one that is to be found.
constexpr std::uint32_t min_returns = 10, required_returns = 400;
/// [m] horizontally, between a find and the stem that it is.
constexpr double same_stem = 0.25;

/// The true stems of a plot, and the returns that each got in one scan.
struct true_stems {
  std::vector<Eigen::Vector3d> positions;  ///< frame of the plot
  std::vector<std::uint32_t> returns;
};

/// What is kept of a scan once its points are gone.
struct evaluated_scan {
  stem_map map;
  double seconds = 0;                        ///< of mapping
  std::vector<Eigen::Vector3d> sample = {};  ///< of the scan, for e_p
  Eigen::Isometry3d plot_from_scan = Eigen::Isometry3d::Identity();
};

/// One point in fifty, in their order: enough for e_p, which is a mean.
template <class Points>
std::vector<Eigen::Vector3d> sample_of(const Points& points) {
  constexpr std::size_t every = 50;
  std::vector<Eigen::Vector3d> sample;
  std::size_t i = 0;
  for (const Eigen::Vector3d& p : points)
    if (i++ % every == 0) sample.push_back(p);
  return sample;
}

/// Maps a scan, and times that.
template <class Points>
evaluated_scan map_scan(const Points& points, const Eigen::Isometry3d& plot_from_scan,
                        const mapping_options& options, const Eigen::Vector3d& up, const execution& exec) {
  const support::stage_clock clock;
  stem_map map = map_stems(points, options, up, exec);
  const double seconds = clock.seconds();
  return {std::move(map), seconds, sample_of(points), plot_from_scan};
}

/// Positions of the stems of a map, in the frame of the plot.
inline std::vector<Eigen::Vector3d> stems_in_plot(const evaluated_scan& scan) {
  std::vector<Eigen::Vector3d> positions;
  for (const stem& s : scan.map.stems) positions.push_back(scan.plot_from_scan * s.position);
  return positions;
}

/// True stems that the scan shows, as their indices.
inline std::vector<std::size_t> seen_stems(const true_stems& stems) {
  std::vector<std::size_t> seen;
  for (std::size_t s = 0; s < stems.positions.size(); ++s)
    if (stems.returns[s] >= min_returns) seen.push_back(s);
  return seen;
}

/// One to one within 25 cm: a find is true if a stem stands there that got at least 10 returns; recall counts
/// those that got at least 400.
inline map_score score_stems(const evaluated_scan& scan, const true_stems& stems) {
  std::vector<Eigen::Vector3d> truth;
  const std::vector<std::size_t> seen = seen_stems(stems);
  for (const std::size_t s : seen) truth.push_back(stems.positions[s]);
  return score_map(stems_in_plot(scan), truth, same_stem,
                   [&](std::size_t s) { return stems.returns[seen[s]] >= required_returns; });
}

/// Sums of finds, means of errors over the true finds of all maps.
inline map_score sum_of(const std::vector<map_score>& scores) {
  map_score sum;
  for (const map_score& s : scores) {
    sum.found += s.found;
    sum.true_finds += s.true_finds;
    sum.required += s.required;
    sum.required_found += s.required_found;
    sum.horizontal_error += s.horizontal_error * double(s.true_finds);
    sum.height_error += s.height_error * double(s.true_finds);
  }
  for (double* mean : {&sum.horizontal_error, &sum.height_error})
    if (sum.true_finds > 0) *mean /= double(sum.true_finds);
  return sum;
}

}  // namespace globalmatch::benchmarks

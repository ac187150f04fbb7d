// Maps that are added to a survey one by one: what they cost, and how far all are from where a new survey of
// all maps places them.
#pragma once

#include <globalmatch/detail/core/statistics.hpp>
#include <globalmatch/growing_survey.hpp>
#include <globalmatch/survey.hpp>

#include "cpu_seconds.hpp"
#include "survey_layouts.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iomanip>
#include <ostream>
#include <vector>

namespace globalmatch::benchmarks {

struct added_maps_score {
  std::vector<double> placed, adjusted;  ///< [CPU s] of each map that was added
  std::vector<double> plan, height;      ///< differences of placed maps, in standard deviations
  std::vector<double> of_added;          ///< of these, in plan, those of maps that were added
  std::size_t other_status = 0, unplaced = 0;
};

/// The scan that the largest component refers to.
inline std::size_t reference_of(const survey& s) {
  std::size_t m = 0;
  while (
      !(s.scans[m].component == 0 && s.scans[m].uncertainty && s.scans[m].uncertainty->covariance(0, 0) == 0))
    ++m;
  return m;
}

inline void compare_surveys(const survey& grown, const survey& fresh, std::size_t first,
                            added_maps_score& score) {
  for (std::size_t m = 0; m < fresh.scans.size(); ++m) {
    const survey::scan &a = grown.scans[m], &b = fresh.scans[m];
    score.other_status += a.status != b.status;
    score.unplaced += m >= first && a.status != survey::status::placed;
    if (!a.uncertainty || !b.uncertainty || b.component != 0 || b.uncertainty->covariance(0, 0) == 0)
      continue;
    const Eigen::Vector3d& center = b.uncertainty->center;
    const Eigen::Vector3d off = a.survey_from_scan * (b.survey_from_scan.inverse() * center) - center;
    const auto& c = b.uncertainty->covariance;
    score.plan.push_back(off.head<2>().norm() / std::sqrt((c(0, 0) + c(1, 1)) / 2));
    if (m >= first) score.of_added.push_back(score.plan.back());
    if (c(2, 2) > 0) score.height.push_back(std::abs(off.z()) / std::sqrt(c(2, 2)));
  }
}

/// The last `count` maps added to a survey of the others.
inline added_maps_score added_maps(const std::vector<surveyed_map>& maps, std::size_t count, int threads) {
  std::vector<positions> stems;
  for (const surveyed_map& m : maps) stems.push_back(m.stems);
  const std::size_t first = stems.size() - std::min(count, stems.size());
  added_maps_score score;
  growing_survey grown(std::vector<positions>(stems.begin(), stems.begin() + std::ptrdiff_t(first)), {},
                       {.threads = threads});
  for (std::size_t m = first; m < stems.size(); ++m) {
    const double start = cpu_seconds();
    double placed = 0;
    grown.add(stems[m], {.threads = threads, .on_progress = [&](const progress& p) {
                           if (placed == 0 && p.stage == "adjustment") placed = cpu_seconds() - start;
                           return true;
                         }});
    score.adjusted.push_back(cpu_seconds() - start);
    score.placed.push_back(placed > 0 ? placed : score.adjusted.back());
  }
  compare_surveys(grown.result(),
                  register_survey(stems, {.reference = reference_of(grown.result())}, {.threads = threads}),
                  first, score);
  return score;
}

inline std::ostream& operator<<(std::ostream& out, added_maps_score s) {
  const auto largest = [](const std::vector<double>& v) {
    return v.empty() ? 0 : *std::max_element(v.begin(), v.end());
  };
  const auto share = [](std::vector<double>& v, double part) {
    return v.empty() ? 0 : nth_smallest(v, std::size_t(part * double(v.size() - 1)));
  };
  return out << std::fixed << std::setprecision(1) << "added " << s.placed.size()
             << " maps: CPU ms until placed " << 1e3 * share(s.placed, 0.5) << " (largest "
             << 1e3 * largest(s.placed) << "), all adjusted " << 1e3 * share(s.adjusted, 0.5) << " (90 % "
             << 1e3 * share(s.adjusted, 0.9) << ", largest " << 1e3 * largest(s.adjusted) << "); "
             << s.unplaced << " of them not placed, " << s.other_status
             << " of all of another status; differences to a new survey [sigmas]: plan "
             << std::setprecision(3) << share(s.plan, 0.5) << ", 99 % " << share(s.plan, 0.99) << ", largest "
             << largest(s.plan) << ", of those added " << largest(s.of_added) << "; height "
             << share(s.height, 0.5) << ", 99 % " << share(s.height, 0.99) << ", largest "
             << largest(s.height);
}

}  // namespace globalmatch::benchmarks

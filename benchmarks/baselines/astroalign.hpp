// astroalign (Beroiz, Cabral, Sanchez 2020, "Astroalign: a Python module for astronomical image
// registration", Astronomy and Computing 32) on stems in plan as if they were stars: triangles with near
// neighbours, found by two ratios of their edges, and RANSAC. By their own program, with all stems; a scale
// is estimated with the rest. Ours: the least squares over all agreeing stems, without scale, in the end. The
// time is that of its search alone.
#pragma once

#include "baselines/consistent_associations.hpp"
#include "support/temporary_file.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <stdexcept>
#include <string>
#include <vector>

namespace globalmatch::benchmarks {

/// What astroalign pairs, and the seconds that it took.
struct astroalign_pairs {
  std::vector<correspondence> pairs = {};
  double seconds = 0;
};

/// Throws `std::runtime_error` where the program cannot be run.
inline astroalign_pairs pair_by_astroalign(const stem_alignment& maps) {
  const support::temporary_file stems("stems"), found("pairs");
  std::ofstream out(stems.path());
  out << std::setprecision(17) << maps.inlier_threshold << '\n' << maps.source.size() << '\n';
  for (const position_set* map : {&maps.source, &maps.target})
    for (const vec3& p : map->at) out << p.x << ' ' << p.y << '\n';
  out.close();
  const std::string command = "\"" GLOBALMATCH_ASTROALIGN_PYTHON "\" \"" GLOBALMATCH_ASTROALIGN_STEMS
                              "\" \"" +
                              stems.path().string() + "\" \"" + found.path().string() + '"';
  if (std::system(command.c_str()) != 0) throw std::runtime_error(command + " failed");
  std::ifstream in(found.path());
  astroalign_pairs result;
  if (!(in >> result.seconds)) throw std::runtime_error(command + " wrote nothing");
  for (correspondence c; in >> c.source >> c.target;) result.pairs.push_back(c);
  return result;
}

/// The search cannot be stopped: one that took too long counts as stopped in the end.
inline match_run run_astroalign(const two_maps& maps, const run_limits& limits, double inlier_threshold) {
  const stem_alignment alignment(maps, inlier_threshold);
  double seconds = 0;
  match_run run = run_within({.threads = limits.threads}, 0, [&](const execution&) {
    match_run result{.funnel = alignment.funnel()};
    if (std::min(alignment.source.size(), alignment.target.size()) < 3) return result;
    const astroalign_pairs found = pair_by_astroalign(alignment);
    seconds = found.seconds;
    result.funnel.consensus = found.pairs.size();
    result.target_from_source = transform_of(alignment, found.pairs);
    return result;
  });
  run.seconds = seconds;
  if (run.seconds > limits.seconds) run.stopped = true, run.target_from_source.reset();
  return run;
}

}  // namespace globalmatch::benchmarks

// Stem maps as mapping would leave them, without a scan.
#pragma once

#include <cmath>

#include "globalmatch/registration_options.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::scenes {

/// A stem map as mapping would leave it: stems, and rings of samples around them on level ground.
inline stem_map made_up_map(const positions& stems) {
  stem_map map;
  for (const Eigen::Vector3d& p : stems) {
    stem s;
    s.position = p;
    s.radius = 0.15;
    map.stems.push_back(s);
    for (int i = 0; i < 60; ++i) {
      const double angle = 0.7 * i;
      const Eigen::Vector3d around(std::cos(angle), std::sin(angle), 0);
      map.stem_samples.push_back(p + 0.15 * around + Eigen::Vector3d(0, 0, 0.03 * i));
      map.ground_samples.push_back(p + (0.3 + 0.01 * i) * around);
    }
  }
  return map;
}

inline registration_options with_icp(icp_metric metric) {
  return {.icp = {.metric = metric}};
}

/// Two maps of the same stems and surfaces, seen from two places.
struct two_maps_of_a_stand {
  positions stems;
  Eigen::Isometry3d truth;  ///< target from source
  stem_map source, target;

  explicit two_maps_of_a_stand(random_source& random)
      : stems(random_stems(random, 25, 25, 25)),
        truth(random_levelled_transform(random)),
        source(made_up_map(stems)),
        target(made_up_map(moved(truth, stems))) {
    target.stem_samples = moved(truth, source.stem_samples);
    target.ground_samples = moved(truth, source.ground_samples);
  }
};

}  // namespace globalmatch::scenes

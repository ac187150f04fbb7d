// Digests of what matching makes of pairs of stem maps, some of them unrelated.
#include <globalmatch/stem_matching.hpp>

#include "digest.hpp"
#include "stem_layouts.hpp"

#include <Eigen/Core>

#include <iostream>
#include <string>
#include <vector>

namespace globalmatch::golden {
namespace {

using namespace detail;

using namespace globalmatch::benchmarks;

void print_pairs() {
  constexpr int seeds = 34;
  random_source random(25);
  for (const char* layout : {"random", "clumped", "rows", "staggered", "spaced", "gradient"})
    for (int seed = 0; seed < seeds; ++seed) {
      const double noise = seed % 3 == 2 ? 0.1 : 0.02, overlap = uniform(random, 0.3, 1);
      const std::size_t stems = 20 + random.below(seed % 8 == 0 ? 400 : 100);
      two_maps maps =
          overlapping_maps(layout, stems, overlap, {.noise = noise, .radius_noise = 0.01}, random);
      if (seed % 11 == 10) maps.target = overlapping_maps(layout, stems, 1, {}, random).target;  // unrelated
      const std::string name = std::string("pairs/") + layout + '_' + std::to_string(seed);
      matching_options options;
      options.horizontal = seed % 5 == 4;
      if (seed % 7 == 6 && !options.horizontal) options.dof = degrees_of_freedom::six;
      const bool measured = seed % 2 == 1 && maps.target.size() == maps.target_radii.size();
      const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
      print(name, [&](const execution& exec) {
        return digest_of(measured ? match_stems(with_radii(maps.source, maps.source_radii),
                                                with_radii(maps.target, maps.target_radii), options, up, exec)
                                  : match_stems(maps.source, maps.target, options, up, exec));
      });
      if (stems > 120) continue;
      options.proposal = proposal::algorithm_1;
      print(name + "/algorithm_1", [&](const execution& exec) {
        return digest_of(match_stems(maps.source, maps.target, options, up, exec));
      });
    }
}

}  // namespace
}  // namespace globalmatch::golden

int main() {
  globalmatch::golden::print_pairs();
  return globalmatch::golden::threads_agree ? 0 : 1;
}

// Positions only: match two lists of trees, as from a field survey and an airborne map. No scan, no ground.
#include <globalmatch/stem_matching.hpp>

#include <Eigen/Geometry>

#include <iostream>
#include <vector>

struct tree {
  double x, y;  // no heights: distances are horizontal
};

int main() {
  const std::vector<tree> survey = {{0.0, 0.0}, {3.1, 0.7}, {6.4, -0.5}, {1.2, 4.0}, {4.8, 3.6},
                                    {8.0, 3.1}, {2.2, 7.5}, {6.1, 7.9},  {9.3, 6.8}, {-2.0, 3.3}};
  // The same trees seen from elsewhere: rotated by 40 degrees and shifted; two are missing, one is new.
  const Eigen::Isometry2d truth = Eigen::Translation2d(120, -45) * Eigen::Rotation2Dd(0.698);
  std::vector<tree> map;
  for (std::size_t i = 0; i < survey.size() - 2; ++i) {
    const Eigen::Vector2d p = truth * Eigen::Vector2d(survey[i].x, survey[i].y);
    map.push_back({p.x(), p.y()});
  }
  map.push_back({118, -30});

  const auto matching = globalmatch::match_stems(survey, map);
  std::cout << to_string(matching.outcome) << ' ' << matching.reason << '\n';
  if (!matching.target_from_source) return 1;
  for (const auto& [s, t] : matching.hypotheses.front().correspondences)
    std::cout << s << " is " << t << '\n';
  std::cout << matching.target_from_source->matrix() << '\n';
  return 0;
}

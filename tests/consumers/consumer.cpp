// What a user's program might do: match the stem maps of two scans, kept in its own type. Needs every
// dependency of the headers. Exit status 0: the answer is right.
#include <globalmatch/stem_matching.hpp>

#include <cmath>
#include <vector>

struct tree_position {
  double x, y, z;
  int species;
};

int main() {
  const std::vector<tree_position> source = {{0, 0, 0, 7}, {4, 0, 0, 7},  {5, 2, 0, 9},  {1, 3, 0, 9},
                                             {9, 5, 1, 7}, {12, 1, 1, 7}, {3, 11, 2, 9}, {8, 14, 2, 9}};
  std::vector<tree_position> target;  // a quarter turn and a shift away
  for (const tree_position& tree : source)
    target.push_back({10 - tree.y, tree.x - 20, tree.z + 3, tree.species});

  const globalmatch::matching result = globalmatch::match_stems(source, target);
  if (result.outcome != globalmatch::outcome::registered) return 1;
  const Eigen::Vector3d moved = *result.target_from_source * Eigen::Vector3d(1, 2, 3);
  const bool right = (moved - Eigen::Vector3d(8, -19, 6)).norm() < 1e-9;
  return right && result.hypotheses.front().correspondences.size() == source.size() ? 0 : 1;
}

// What a user's program might do: its own point type, the nearest neighbour of each point, in parallel.
// Needs every dependency of the headers. Exit status 0: the answer is right.
#include <globalmatch/execution.hpp>
#include <globalmatch/neighbors.hpp>
#include <globalmatch/points.hpp>

#include <vector>

struct tree_position {
  double x, y, z;
  int species;
};

int main() {
  const std::vector<tree_position> trees = {{0, 0, 0, 7}, {4, 0, 0, 7}, {5, 0, 0, 9}, {0, 3, 0, 9}};
  const globalmatch::neighbor_tree<double, 3> tree(trees.size(),
                                                   [&](std::size_t i) { return globalmatch::xyz(trees[i]); });
  std::vector<std::uint32_t> nearest_other(trees.size());
  globalmatch::parallel_for({}, "nearest", trees.size(), [&](std::size_t i) {
    std::vector<globalmatch::neighbor<double>> found;
    tree.nearest(tree[i], 2, found);
    nearest_other[i] = found[1].index;
  });
  return nearest_other == std::vector<std::uint32_t>{3, 2, 1, 0} ? 0 : 1;
}

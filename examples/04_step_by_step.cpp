// Step by step: the boxes of the paper's pipeline figure, each called alone, with what it leaves.
#include <globalmatch/globalmatch.hpp>

#include "support/scan_files.hpp"

#include <iostream>
#include <vector>

using namespace globalmatch;

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: 04_step_by_step SOURCE TARGET\n";
    return 2;
  }

  // Section 3.1: the stems of each scan.
  const stem_map source_map = map_stems(support::open_scan(argv[1]));
  const stem_map target_map = map_stems(support::open_scan(argv[2]));
  const position_set source = import_positions(source_map.stems, source_map.up, "source");
  const position_set target = import_positions(target_map.stems, target_map.up, "target");
  std::cout << source.size() << " and " << target.size() << " stems\n";

  // Section 3.2.1: triangles of stems that are near each other.
  const auto source_triangles = build_triangles(source, false);
  const auto target_triangles = build_triangles(target, false);
  std::cout << source_triangles.size() << " and " << target_triangles.size() << " triangles\n";

  // Section 3.2.2, local matching: congruent triangles. Section 3.2.3, global matching: those that agree.
  constexpr double epsilon = 0.05;  // [m]
  const auto pairs = match_locally(source_triangles, target_triangles, epsilon);
  const consensus_set consensus = match_globally(source, target, false, pairs, epsilon);
  std::cout << pairs.size() << " congruent pairs, " << consensus.size << " of them agree on "
            << consensus.correspondences.size() << " stems\n";

  // Section 3.3: the transform of corresponding stems. Whether it is to be trusted, match_stems decides.
  std::vector<Eigen::Vector3d> source_points, target_points;
  for (const auto& [s, t] : consensus.correspondences) {
    source_points.push_back(source_map.stems[source.original[s]].position);
    target_points.push_back(target_map.stems[target.original[t]].position);
  }
  constexpr auto dof = degrees_of_freedom::four;  // the scans are level
  const auto coarse = fit_transform(source_points, target_points, dof);
  if (!coarse) {
    std::cerr << "too few stems correspond\n";
    return 1;
  }

  // Fine registration: ground to ground, stems to stems.
  const std::vector<icp_layer> layers = {
      {source_map.ground_samples, target_map.ground_samples},
      {source_map.stem_samples, target_map.stem_samples, source_map.stem_normals, target_map.stem_normals}};
  const icp_result fine = refine_by_icp(layers, *coarse, dof);
  std::cout << "coarse\n" << coarse->matrix() << '\n';
  if (fine.converged) std::cout << "fine\n" << fine.target_from_source.matrix() << '\n';
  return 0;
}

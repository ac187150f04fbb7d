// Step by step: every box of the paper's pipeline figure called alone, with what it leaves.
#include <globalmatch/globalmatch.hpp>

#include "support/scan_files.hpp"

#include <iostream>

using namespace globalmatch;

namespace {

/// Section 3.1: from a scan to stem positions.
std::vector<stem> map_by_steps(const std::vector<Eigen::Vector3d>& scan) {
  const ground_model ground = model_ground(scan);
  local_points understory = select_understory(scan, ground.terrain);
  std::cout << scan.size() << " points, " << understory.size() << " in the understory";

  const cell_columns cells = sort_into_cells(std::move(understory), 0.05);  // [m]
  const std::vector<cell_surface> surfaces = estimate_surfaces(cells);
  const point_clusters clusters = cluster_cells(cells, surfaces, {}, 15);
  std::cout << " in " << cells.cells() << " cells, " << clusters.members.size() << " on vertical surfaces";

  const stem_cylinders cylinders = find_stem_cylinders(cells, clusters);
  const auto stems =
      merge_fragments(cylinders, cells.points(), ground.terrain, stem_cylinder_options{}.cylinder);
  std::cout << ", " << clusters.size() << " clusters, " << stems.size() << " stems\n";
  return locate_stems(stems, cells.points(), ground.terrain);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: 04_step_by_step SOURCE TARGET\n";
    return 2;
  }
  const auto source_stems = map_by_steps(support::read_scan(argv[1]));
  const auto target_stems = map_by_steps(support::read_scan(argv[2]));

  // Section 3.2: from stem positions to hypotheses.
  constexpr double tolerance = 0.05;  // [m] epsilon
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const position_set source = import_positions(source_stems, up, "source");
  const position_set target = import_positions(target_stems, up, "target");
  const auto source_triangles = build_triangles(source, false),
             target_triangles = build_triangles(target, false);
  const auto pairs = match_locally(source_triangles, target_triangles, tolerance);
  const matching_context maps(source, target, false, degrees_of_freedom::four);
  const null_model null(maps);
  std::vector<hypothesis> hypotheses;
  for (hypothesis& h : match_globally(maps, pairs, tolerance)) {
    score_hypothesis(h, maps, null, std::span(&tolerance, 1));
    add_distinct(std::move(h), hypotheses, maps);
  }
  rank(hypotheses);
  std::cout << source_triangles.size() << " and " << target_triangles.size() << " triangles, " << pairs.size()
            << " congruent pairs, " << hypotheses.size() << " hypotheses\n";

  // Section 3.3: from the best hypothesis, if it is to be trusted, to the motion between the scans.
  const decision decided = decide(hypotheses, maps);
  std::cout << to_string(decided.outcome) << ' ' << decided.reason << '\n';
  if (decided.outcome != outcome::registered) return 1;
  const Eigen::Isometry3d target_from_source = target.frame.local_from_scan().inverse() *
                                               hypotheses.front().target_from_source *
                                               source.frame.local_from_scan();
  std::cout << hypotheses.front().correspondences.size() << " stems matched\n"
            << target_from_source.matrix() << '\n';
  return 0;
}

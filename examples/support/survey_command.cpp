#include "support/survey_command.hpp"

#include <stdexcept>

#include "support/scan_sets.hpp"

namespace globalmatch::support {

void survey_command::add_to(CLI::App& app) {
  auto* scans_given =
      app.add_option("SCAN", scans, "scans, or folders of them; name#K: scan K of a file of several");
  auto* maps_given = app.add_option("--stem-maps", stem_maps, "stem maps (CSV) in place of scans")
                         ->excludes(scans_given)
                         ->type_name("CSV");
  app.add_option("--out-dir", out_dir, "folder for poses.csv, links.csv, trees.csv, T_<scan>.txt, maps/")
      ->required()
      ->type_name("DIR");
  app.add_option("--fix", fix, "a scan whose matrix survey_from_scan is known")->type_name("NAME=T.txt");
  auto* one_stage = app.add_option("--only", only, "map: map the scans, and register them another time")
                        ->check(CLI::IsMember({"map"}));
  app.add_option("--part", part, "with --only map: every N-th of the scans, to be shared out over machines")
      ->needs(one_stage)
      ->excludes(maps_given)
      ->type_name("I/N");
  app.add_option("--report", picture, "drawing of scans, links and trees (SVG)")->type_name("FILE");
  options.add_mapping_to(app);
  options.add_threads_to(app);
}

std::vector<std::filesystem::path> survey_command::inputs() const {
  if (scans.empty() && stem_maps.empty())
    throw std::invalid_argument("SCAN: name scans, a folder of them, or --stem-maps");
  return scans.empty() ? stem_maps : find_scans(scans, options.tiles);
}

}  // namespace globalmatch::support

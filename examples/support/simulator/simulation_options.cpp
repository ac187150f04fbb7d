#include "support/simulator/simulation_options.hpp"

#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "support/simulator/scenes.hpp"

namespace globalmatch::support {

void add_simulation_options(CLI::App& app, simulation_options& o) {
  const auto add = [&](const char* name, auto& field, const char* meaning) {
    return app.add_option(name, field, meaning)->capture_default_str();
  };
  std::vector<std::string> scenes;
  for (const named_scene& scene : frozen_scenes()) scenes.push_back(scene.name);
  app.add_option_function<std::string>(
         "--scene", [&o](const std::string& name) { o = find_scene(name).options; },
         "one of the frozen scenes; further options override it")
      ->check(CLI::IsMember(scenes));
  app.add_flag_callback(
      "--list-scenes",
      [] {
        std::cout << scene_table();
        throw CLI::Success();
      },
      "print the frozen scenes and exit");
  app.add_flag_callback(
         "--mobile", [&o] { o = with_carried_scanner(o); },
         "carry the scanner through the plot, each station is another way; with the noise, range and beam of "
         "scene `mobile`, unless further options override them")
      ->disable_flag_override();
  add("--width", o.plot.width, "of the plot along x [m]");
  add("--depth", o.plot.depth, "of the plot along y [m]");
  add("--margin", o.plot.margin, "of the same forest around the plot [m]");
  const std::map<std::string, arrangement> arrangements = {
      {"random", arrangement::random}, {"clumped", arrangement::clumped}, {"rows", arrangement::rows}};
  app.add_option("--layout", o.plot.layout.arrangement, "of the stems: random, clumped or rows")
      ->transform(CLI::CheckedTransformer(arrangements))
      ->option_text("NAME");
  add("--density", o.plot.layout.stems_per_hectare, "stems per hectare, but for rows");
  add("--row-spacing", o.plot.layout.row_spacing, "between rows [m]");
  add("--tree-spacing", o.plot.layout.tree_spacing, "along rows [m]");
  add("--row-jitter", o.plot.layout.row_jitter, "standard deviation of places in rows, along x and y [m]");
  add("--missing", o.plot.layout.missing, "share of the places in rows that are empty");
  add("--height", o.plot.trees.height, "of a tree of 20 cm [m]");
  add("--lean", o.plot.trees.lean, "median lean of stems [deg]");
  add("--shrubs", o.plot.undergrowth.shrubs_per_hectare, "shrubs per hectare");
  add("--grass", o.plot.undergrowth.blades_per_square_metre, "blades of grass per square metre");
  add("--slope", o.plot.ground.slope, "of the ground [deg]");
  add("--relief", o.plot.ground.relief, "of the ground's long waves [m]");
  add("--harvest", o.plot.harvest, "share of the stems felled between scans");
  add("--harvested-from", o.harvested_from, "number of the first station after the harvest");
  add("--stations", o.stations.count, "number of scans");
  add("--station-distance", o.stations.distance, "of all other stations from the first [m]");
  add("--tilt", o.stations.tilt, "of scanners from the vertical [deg]");
  add("--angular-step", o.scanner.angular_step, "between rays [deg]");
  add("--noise", o.scanner.range_noise, "standard deviation of ranges [m]");
  add("--max-range", o.scanner.max_range, "of the scanner [m]");
  add("--seed", o.seed, "of all that is random");
}

}  // namespace globalmatch::support

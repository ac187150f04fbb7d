#include "support/simulator/scenes.hpp"

#include <algorithm>
#include <sstream>
#include <stdexcept>

namespace globalmatch::support {
namespace {

/// What all scenes start from: five stations, one in the middle and four around it.
simulation_options five_stations(double width, double depth, double distance) {
  simulation_options o;
  o.plot.width = width;
  o.plot.depth = depth;
  o.stations.count = 5;
  o.stations.distance = distance;
  return o;
}

/// The shape of a random forest, on which the single difficulties are tried one by one.
simulation_options natural_plot() {
  simulation_options o = five_stations(50, 50, 12);
  o.plot.layout.stems_per_hectare = 600;
  return o;
}

simulation_options plot_a_like() {
  simulation_options o = five_stations(55, 55, 12);
  o.plot.margin = 0;  // that plot has none
  o.plot.layout.stems_per_hectare = 700;
  o.plot.ground.relief = 2.8;
  o.plot.ground.wavelength = 45;
  o.plot.trees.pairs = o.plot.trees.multi_stem = o.plot.trees.forked = 0;
  o.plot.trees.lean = 1.2;
  o.plot.trees.sweep = 0.05;
  o.plot.undergrowth.shrubs_per_hectare = 500;
  o.plot.undergrowth.shrub_max_height = 1.8;
  return o;
}

simulation_options metasequoia(double width, double depth, double distance, double per_hectare,
                               double height) {
  simulation_options o = five_stations(width, depth, distance);
  o.plot.layout.stems_per_hectare = per_hectare;
  o.plot.layout.min_spacing = 1;
  o.plot.trees.height = height;
  o.plot.trees.crown_radius = 1.4;
  o.plot.trees.lean = 1.5;
  o.plot.trees.flare = 0.6;
  return o;
}

simulation_options plot_1() {
  simulation_options o = metasequoia(65, 50, 15, 1036, 19);
  o.plot.undergrowth.blades_per_square_metre = 60;
  o.plot.undergrowth.shrubs_per_hectare = 50;
  return o;
}

simulation_options plot_2() {
  simulation_options o = metasequoia(90, 50, 18, 1210, 23);
  o.plot.undergrowth.shrubs_per_hectare = 2000;
  o.plot.undergrowth.shrub_min_height = 0.7;
  o.plot.undergrowth.shrub_max_height = 1.5;
  return o;
}

simulation_options planted_rows(double width, double depth, double distance, double height) {
  simulation_options o = five_stations(width, depth, distance);
  o.plot.layout.arrangement = arrangement::rows;
  o.plot.trees.height = height;
  o.plot.trees.pairs = o.plot.trees.multi_stem = 0;
  o.plot.ground.hump_height = 0.8;
  o.plot.undergrowth = {};
  o.plot.undergrowth.shrubs_per_hectare = 20;
  return o;
}

simulation_options plot_3() {
  simulation_options o = planted_rows(80, 40, 15, 7);
  o.plot.layout.row_spacing = 5;
  o.plot.layout.tree_spacing = 4.5;
  o.plot.layout.missing = 0.03;
  o.scanner.angular_step = 0.08;  // few trees, and thin ones
  o.plot.trees.dbh_scale = 0.07;
  o.plot.trees.crown_base = 0.3;
  return o;
}

simulation_options plot_4() {
  simulation_options o = planted_rows(65, 55, 15, 10);
  o.plot.layout.row_spacing = o.plot.layout.tree_spacing = 3;
  o.plot.layout.missing = 0.16;
  o.plot.trees.dbh_scale = 0.1;
  o.plot.trees.crown_base = 0.3;
  return o;
}

simulation_options sparse_natural() {
  simulation_options o = five_stations(60, 60, 15);
  o.plot.layout.arrangement = arrangement::clumped;
  o.plot.layout.stems_per_hectare = 250;
  o.plot.trees.dbh_scale = 0.28;
  o.plot.trees.dbh_shape = 1.8;
  o.plot.trees.height = 18;
  o.plot.trees.multi_stem = 0.08;
  o.plot.undergrowth.shrubs_per_hectare = 300;
  o.plot.undergrowth.logs_per_hectare = 60;
  return o;
}

simulation_options underwood() {
  simulation_options o = natural_plot();
  o.plot.undergrowth.shrubs_per_hectare = 2500;
  o.plot.undergrowth.shrub_max_height = 3;
  o.plot.trees.dead_branches = 25;
  return o;
}

simulation_options slope(double degrees) {
  simulation_options o = natural_plot();
  o.plot.ground.slope = degrees;
  o.plot.trees.lean = 3;
  return o;
}

simulation_options lean_12() {
  simulation_options o = natural_plot();
  o.plot.trees.lean = 12;
  return o;
}

simulation_options tilt(double degrees) {
  simulation_options o = natural_plot();
  o.stations.tilt = degrees;
  return o;
}

simulation_options far_30() {
  simulation_options o = five_stations(80, 80, 30);
  o.plot.layout.stems_per_hectare = 400;
  return o;
}

simulation_options harvest_40() {
  simulation_options o = natural_plot();
  o.plot.harvest = 0.4;
  return o;
}

/// Few trees on bare humps, seen from far: much of the ground between them is hidden.
simulation_options sparse_far() {
  simulation_options o = five_stations(130, 130, 35);
  o.plot.layout.stems_per_hectare = 110;
  o.plot.ground.relief = 1.2;
  o.plot.ground.hump_height = 0.9;
  o.scanner.max_range = 90;
  return o;
}

simulation_options far_slope() {
  simulation_options o = five_stations(120, 120, 45);
  o.plot.layout.stems_per_hectare = 400;
  o.plot.ground.slope = 10;
  o.scanner.max_range = 90;
  return o;
}

simulation_options thicket() {
  simulation_options o = five_stations(70, 70, 22);
  o.plot.layout.stems_per_hectare = 900;
  o.plot.ground.slope = 15;
  o.plot.undergrowth.shrubs_per_hectare = 3000;
  o.plot.undergrowth.shrub_max_height = 2;
  o.scanner.max_range = 90;
  return o;
}

simulation_options mobile() {
  return with_carried_scanner(natural_plot());
}

const char* name_of(arrangement a) {
  switch (a) {
    case arrangement::random:
      return "random";
    case arrangement::clumped:
      return "clumped";
    case arrangement::rows:
      return "rows";
  }
  return "";
}

std::string layout_of(const layout_options& o) {
  std::ostringstream text;
  text << name_of(o.arrangement);
  if (o.arrangement == arrangement::rows)
    text << ' ' << o.row_spacing << " x " << o.tree_spacing << " m, " << 100 * o.missing << " % missing";
  else
    text << ", " << o.stems_per_hectare;
  return text.str();
}

}  // namespace

const std::vector<named_scene>& frozen_scenes() {
  static const std::vector<named_scene> scenes = {
      {"plot_a_like", "a ray-cast plot made by others, which this simulator is compared with", plot_a_like()},
      {"plot_1", "[GM] plot 1: dense, wild grass", plot_1()},
      {"plot_2", "[GM] plot 2: denser, breast-high shrubs", plot_2()},
      {"plot_3", "[GM] plot 3: wide rows of low trees, bare humps", plot_3()},
      {"plot_4", "[GM] plot 4: narrow rows, bare humps", plot_4()},
      {"sparse_natural", "few trees in clumps, of all sizes", sparse_natural()},
      {"underwood", "shrubs up to 3 m, many dead branches", underwood()},
      {"slope_15", "a slope", slope(15)},
      {"slope_28", "a steep slope", slope(28)},
      {"lean_12", "half of the stems lean more than 12 degrees", lean_12()},
      {"tilt_3", "scanners that were not levelled", tilt(3)},
      {"tilt_8", "scanners that were clearly tilted", tilt(8)},
      {"far_30", "stations 30 m apart", far_30()},
      {"harvest_40", "40 % of the stems felled after the first scan", harvest_40()},
      {"mobile", "carried along five ways through the plot", mobile()},
      {"sparse_far", "few trees on humps, stations 35 to 70 m apart", sparse_far()},
      {"far_slope", "a slope, stations 45 to 90 m apart", far_slope()},
      {"thicket", "dense trees and shrubs on a slope", thicket()},
  };
  return scenes;
}

const named_scene& find_scene(std::string_view name) {
  const auto& all = frozen_scenes();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const named_scene& s) { return s.name == name; });
  if (found != all.end()) return *found;
  std::string names;
  for (const named_scene& s : all) names += ' ' + s.name;
  throw std::invalid_argument("there is no scene " + std::string(name) + "; the scenes are:" + names);
}

std::string scene_table() {
  std::ostringstream table;
  table << "| scene | about | plot [m] | stems [1/ha] | height [m] | DBH: min + scale, shape [m] | lean, "
           "slope [deg] "
           "| relief + humps [m] | shrubs [1/ha], height [m] | grass [1/m2] | stations, distance [m] | tilt "
           "[deg] | step [deg] |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const auto& [name, about, o] : frozen_scenes()) {
    const tree_options& trees = o.plot.trees;
    const undergrowth_options& under = o.plot.undergrowth;
    table << "| `" << name << "` | " << about << " | " << o.plot.width << " x " << o.plot.depth << " | "
          << layout_of(o.plot.layout) << " | " << trees.height << " | " << trees.dbh_min << " + "
          << trees.dbh_scale << ", " << trees.dbh_shape << " | " << trees.lean << ", " << o.plot.ground.slope
          << " | " << o.plot.ground.relief << " + " << o.plot.ground.hump_height << " | "
          << under.shrubs_per_hectare << ", " << under.shrub_min_height << "-" << under.shrub_max_height
          << " | " << under.blades_per_square_metre << " | " << o.stations.count << ", ";
    if (o.mobile)
      table << "ways | " << o.stations.tilt << " | random |\n";
    else
      table << o.stations.distance << " | " << o.stations.tilt << " | " << o.scanner.angular_step << " |\n";
  }
  return table.str();
}

}  // namespace globalmatch::support

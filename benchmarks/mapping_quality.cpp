// Maps the simulated scans of docs/scenes.md and compares the stems with the true ones: seconds by stage and
// per million points, peak memory, precision, recall by returns, errors of positions and radii.
#include <globalmatch/detail/core/statistics.hpp>
#include <globalmatch/evaluation.hpp>
#include <globalmatch/stem_mapping.hpp>

#include "growth.hpp"
#include "peak_memory.hpp"
#include "support/atomic_file.hpp"
#include "support/programs/command_line.hpp"
#include "support/programs/reports.hpp"
#include "support/simulator/scenes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iomanip>
#include <iostream>
#include <limits>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::detail;
using Eigen::Vector3d;

namespace {

constexpr std::uint32_t min_returns = 10;   // of a stem that a true find stands for
constexpr std::uint32_t well_seen = 400;    // a stem with so many returns should be found
constexpr std::uint32_t hardly_seen = 200;  // with so many it should be found nine times in ten
constexpr double near = 15;                 // [m] from the scanner radii should be right

/// A true stem that was found.
struct found_stem {
  double distance = 0;                                              // [m] from the scanner, horizontal
  double horizontal_error = 0, height_error = 0, radius_error = 0;  // [m]
  double horizontal_sigma = 0, height_sigma = 0, radius_sigma = 0;  // [m] as reported
  bool ground_all_around = true;                                    // `has_ground_all_around`
};

/// What a stem's quality said, and what was so.
struct scored_find {
  double quality = 0;
  bool is_true = false;
};

/// What a scan was like, and what came of it.
struct mapped_scan {
  std::string scene;
  std::uint64_t seed = 0;
  std::size_t station = 0, points = 0, understory = 0;
  double seconds = 0, megabytes = 0;     // of mapping; beyond the points of the scan
  std::map<std::string, double> stages;  // seconds
  std::size_t found = 0, required = 0, required_found = 0, faint = 0, faint_found = 0;
  std::vector<found_stem> true_finds;
  std::vector<scored_find> decided;
};

/// Whether ground was seen within a metre of a stem in each of eight directions.
bool has_ground_all_around(const stem_map& map, const stem& s) {
  constexpr double radius = 1;  // [m]
  std::array<bool, 8> seen{};
  for (const Vector3d& p : map.ground_samples) {
    const Eigen::Vector2d d = (p - s.position).head<2>();
    if (d.squaredNorm() > radius * radius) continue;
    const double turn = std::atan2(d.y(), d.x()) / (2 * std::numbers::pi) + 0.5;
    seen[std::min(std::size_t(8 * turn), std::size_t(7))] = true;
  }
  return std::all_of(seen.begin(), seen.end(), [](bool octant) { return octant; });
}

void score(mapped_scan& result, const stem_map& map, const support::simulated_scan& scan,
           const std::vector<support::stem>& stems, const Eigen::Isometry3d& plot_from_scan) {
  std::vector<Vector3d> finds, truth;
  std::vector<std::size_t> index;
  for (const stem& s : map.stems) finds.push_back(plot_from_scan * s.position);
  for (std::size_t s = 0; s < stems.size(); ++s)
    if (scan.returns_per_stem[s] >= min_returns) {
      truth.push_back(stems[s].position);
      index.push_back(s);
    }
  std::vector<bool> is_found(stems.size());
  for (const stem& s : map.stems) result.decided.push_back({s.quality, false});
  for (const auto& [find, t] : pair_finds(finds, truth)) {
    result.decided[find].is_true = true;
    const Vector3d error = finds[find] - truth[t];
    const auto& true_stem = stems[index[t]];
    is_found[index[t]] = true;
    result.true_finds.push_back({.distance = map.stems[find].position.head<2>().norm(),
                                 .horizontal_error = error.head<2>().norm(),
                                 .height_error = error.z(),
                                 .radius_error = map.stems[find].radius - true_stem.dbh / 2,
                                 .horizontal_sigma = map.stems[find].position_sigma,
                                 .height_sigma = map.stems[find].height_sigma,
                                 .radius_sigma = map.stems[find].radius_sigma,
                                 .ground_all_around = has_ground_all_around(map, map.stems[find])});
  }
  result.found = finds.size();
  for (std::size_t s = 0; s < stems.size(); ++s) {
    const std::uint32_t returns = scan.returns_per_stem[s];
    result.required += returns >= well_seen;
    result.required_found += returns >= well_seen && is_found[s];
    result.faint += returns >= hardly_seen && returns < well_seen;
    result.faint_found += returns >= hardly_seen && returns < well_seen && is_found[s];
  }
}

mapped_scan map_scan(support::simulation& plot, std::size_t station, const mapping_options& options, int runs,
                     const execution& exec) {
  const auto scan = plot.scan(station, exec);
  mapped_scan result;
  result.station = station + 1;
  result.points = scan.points.size();
  result.seconds = std::numeric_limits<double>::infinity();
  for (int run = 0; run < runs; ++run) {
    benchmarks::reset_peak_memory();
    const double before = benchmarks::peak_memory();
    support::stage_clock clock;
    const stem_map map = map_stems(scan.points, options, Vector3d::UnitZ(), clock.listen(exec.threads));
    const double seconds = clock.seconds();
    if (seconds < result.seconds) {
      result.seconds = seconds;
      const auto stages = clock.stages();
      for (const auto& stage : stages.items()) result.stages[stage.key()] = stage.value();
    }
    result.megabytes = benchmarks::peak_memory() - before;
    if (run > 0) continue;
    result.understory = map.funnel.thinned;
    score(result, map, scan, plot.plot().stems, plot.stations()[station].plot_from_scan);
  }
  return result;
}

/// Not a number when there is none.
double percent(std::size_t part, std::size_t all) {
  return all > 0 ? 100 * double(part) / double(all) : std::numeric_limits<double>::quiet_NaN();
}

/// The value that a share of the values is below; not a number when there is none.
double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

constexpr const char* table_head =
    "| scans of | points [M] | s per M points, worst | bytes a point | precision | recall | recall of 200 to "
    "400 returns [%] | horizontal error [cm] | height error: all; where ground lies all around, 90 % of "
    "these [cm] "
    "| radius within 15 m: error, bias [cm] |\n|---|---|---|---|---|---|---|---|---|---|\n";

void print_row(std::ostream& out, const std::string& name, const std::vector<mapped_scan>& scans) {
  double points = 0, seconds = 0, worst = 0, bytes = 0;
  std::size_t found = 0, required = 0, required_found = 0, faint = 0, faint_found = 0;
  std::vector<double> horizontal, height, height_all_around, radius, radius_error;
  for (const mapped_scan& s : scans) {
    points += double(s.points) / 1e6;
    seconds += s.seconds;
    worst = std::max(worst, s.seconds / double(s.points) * 1e6);
    bytes = std::max(bytes, s.megabytes * 1048576 / double(s.points));
    found += s.found;
    required += s.required;
    required_found += s.required_found;
    faint += s.faint;
    faint_found += s.faint_found;
    for (const found_stem& f : s.true_finds) {
      horizontal.push_back(100 * f.horizontal_error);
      height.push_back(100 * std::abs(f.height_error));
      if (f.ground_all_around) height_all_around.push_back(height.back());
      if (f.distance > near) continue;
      radius.push_back(100 * std::abs(f.radius_error));
      radius_error.push_back(100 * f.radius_error);
    }
  }
  out << std::fixed << std::setprecision(1) << "| " << name << " | " << points / double(scans.size()) << " | "
      << std::setprecision(3) << seconds / points << ", " << worst << " | " << std::setprecision(1) << bytes
      << " | " << percent(horizontal.size(), found) << " | " << percent(required_found, required) << " | "
      << percent(faint_found, faint) << " | " << std::setprecision(2) << median(horizontal) << " | "
      << median(height) << "; " << median(height_all_around) << ", " << quantile(height_all_around, 0.9)
      << " | " << median(radius) << ", " << median(radius_error) << " |\n"
      << std::flush;
}

constexpr const char* csv_head =
    "scene,seed,station,points,thinned,seconds,megabytes,found,true_finds,required,required_found,faint,"
    "faint_found,stages\n";

void print_line(std::ostream& out, const mapped_scan& s) {
  out << s.scene << ',' << s.seed << ',' << s.station << ',' << s.points << ',' << s.understory << ','
      << s.seconds << ',' << s.megabytes << ',' << s.found << ',' << s.true_finds.size() << ',' << s.required
      << ',' << s.required_found << ',' << s.faint << ',' << s.faint_found << ',';
  for (const auto& [stage, seconds] : s.stages) out << stage << ' ' << seconds << "; ";
  out << '\n';
}

/// Nanoseconds a point and stage, over all scans.
void print_stages(std::ostream& out, const std::vector<mapped_scan>& scans) {
  std::map<std::string, double> sums;
  double points = 0;
  for (const mapped_scan& s : scans) {
    points += double(s.points);
    for (const auto& [stage, seconds] : s.stages) sums[stage] += seconds;
  }
  out << "\n| stage | ns a point |\n|---|---|\n" << std::setprecision(1);
  for (const auto& [stage, seconds] : sums) out << "| " << stage << " | " << 1e9 * seconds / points << " |\n";
}

/// Whether the qualities and standard deviations that stems carry are what they say.
void print_calibration(std::ostream& out, const std::vector<mapped_scan>& scans) {
  constexpr double ellipse_95 = 2.45;  // standard deviations, of two coordinates
  struct bin {
    double max_quality = 1, sum = 0;
    std::size_t finds = 0, true_finds = 0;
  };
  std::vector<bin> bins;
  for (int tenths = 1; tenths <= 10; ++tenths) bins.push_back({.max_quality = 0.1 * tenths});
  bins.back().max_quality = 1;
  std::size_t all = 0, horizontal = 0, height_1 = 0, height_2 = 0, radius_1 = 0, radius_2 = 0;
  for (const mapped_scan& s : scans) {
    for (const scored_find& f : s.decided) {
      bin& b =
          *std::find_if(bins.begin(), bins.end(), [&](const bin& at) { return f.quality <= at.max_quality; });
      b.sum += f.quality;
      ++b.finds;
      b.true_finds += f.is_true;
    }
    for (const found_stem& f : s.true_finds) {
      ++all;
      horizontal += f.horizontal_error <= ellipse_95 * f.horizontal_sigma;
      height_1 += std::abs(f.height_error) <= f.height_sigma;
      height_2 += std::abs(f.height_error) <= 2 * f.height_sigma;
      radius_1 += std::abs(f.radius_error) <= f.radius_sigma;
      radius_2 += std::abs(f.radius_error) <= 2 * f.radius_sigma;
    }
  }
  out << "\n| quality up to | stems | mean quality [%] | true [%] |\n|---|---|---|---|\n"
      << std::setprecision(1);
  for (const bin& b : bins)
    if (b.finds > 0)
      out << "| " << b.max_quality << " | " << b.finds << " | " << 100 * b.sum / double(b.finds) << " | "
          << percent(b.true_finds, b.finds) << " |\n";
  out << "\nOf " << all << " true finds the horizontal error is within the 95 % ellipse for "
      << percent(horizontal, all) << " %; in height within one standard deviation for "
      << percent(height_1, all) << " %, two " << percent(height_2, all) << " %; of the radius "
      << percent(radius_1, all) << " and " << percent(radius_2, all) << " %.\n";
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Maps the scenes of docs/scenes.md, a row for each.", "mapping_quality");
  std::vector<std::string> names;
  for (const auto& scene : support::frozen_scenes()) names.push_back(scene.name);
  std::vector<std::uint64_t> seeds(std::begin(support::tuning_seeds), std::end(support::tuning_seeds));
  std::vector<double> angular_steps;
  std::size_t stations = 0;
  int runs = 1;
  std::filesystem::path csv_file = "mapping_quality.csv";
  support::shared_options shared;
  app.add_option("--scenes", names, "names of scenes")->delimiter(',');
  app.add_option("--seeds", seeds, "of the scenes")->delimiter(',')->capture_default_str();
  app.add_option("--angular-steps", angular_steps, "instead of the scenes' own [deg], a row for each")
      ->delimiter(',');
  app.add_option("--stations", stations, "of each plot; 0: all")->capture_default_str();
  app.add_option("--runs", runs, "of each scan, of which the fastest counts")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--csv", csv_file, "file with a line for each scan")->capture_default_str();
  shared.add_mapping_to(app);
  shared.add_threads_to(app);

  return support::run_program(app, argc, argv, [&] {
    support::atomic_file csv(csv_file);
    csv.stream() << csv_head;
    const execution exec{.threads = shared.threads};
    std::cout << table_head;
    std::vector<mapped_scan> all;
    for (const std::string& name : names) {
      std::vector<std::pair<double, double>> growth;  // points, seconds
      for (const double step : angular_steps.empty() ? std::vector<double>{0} : angular_steps) {
        std::vector<mapped_scan> scans;
        for (const std::uint64_t seed : seeds) {
          support::simulation_options options = support::find_scene(name).options;
          options.seed = seed;
          if (step > 0) options.scanner.angular_step = step;
          support::simulation plot(options);
          const std::size_t last = plot.stations().size();
          for (std::size_t i = 0; i < (stations > 0 ? std::min(stations, last) : last); ++i) {
            scans.push_back(map_scan(plot, i, shared.for_mapping(), runs, exec));
            scans.back().scene = name;
            scans.back().seed = seed;
            print_line(csv.stream(), scans.back());
            growth.push_back({double(scans.back().points), scans.back().seconds});
          }
        }
        std::ostringstream title;
        title << '`' << name << '`';
        if (step > 0) title << ", " << step << " degrees";
        print_row(std::cout, title.str(), scans);
        all.insert(all.end(), scans.begin(), scans.end());
      }
      if (angular_steps.size() > 1)
        std::cout << "| growth exponent | | " << benchmarks::growth_exponent(growth) << " | | | | | | | |\n";
    }
    print_stages(std::cout, all);
    print_calibration(std::cout, all);
    csv.commit();
    return support::done;
  });
}

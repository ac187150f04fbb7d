// Spoils simulated scans as people's scans are spoilt, maps them, and compares the stems with the true ones:
// noise below the ground, ground that was cut off, and what stems say of their heights.
#include <globalmatch/detail/core/random.hpp>
#include <globalmatch/detail/core/statistics.hpp>
#include <globalmatch/evaluation.hpp>
#include <globalmatch/stem_mapping.hpp>

#include "support/atomic_file.hpp"
#include "support/programs/command_line.hpp"
#include "support/simulator/scenes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iomanip>
#include <iostream>
#include <limits>
#include <map>
#include <string>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::detail;
using Eigen::Vector3d;
using cloud = std::vector<Vector3d>;

namespace {

double in_range(random_source& random, double low, double high) {
  return low + (high - low) * double(random.below(1u << 30)) / double(1u << 30);
}

/// All that stands higher than `height` [m] in the scanner's frame.
cloud cut_below(const cloud& scan, double height) {
  cloud kept;
  for (const Vector3d& p : scan)
    if (p.z() >= height) kept.push_back(p);
  return kept;
}

/// The scan with 300 more points in a clump 0.5 m wide, `depth` [m] below the ground point that lies nearest
/// to 6 m from the scanner.
cloud with_clump(cloud scan, const cloud& ground, double depth, random_source& random) {
  const auto off = [](const Vector3d& p) { return std::abs(p.head<2>().norm() - 6); };
  const Vector3d at = *std::min_element(ground.begin(), ground.end(), [&](const auto& a, const auto& b) {
    return off(a) < off(b);
  }) - Vector3d(0, 0, depth);
  for (int i = 0; i < 300; ++i)
    scan.push_back(at + Vector3d(in_range(random, -0.25, 0.25), in_range(random, -0.25, 0.25),
                                 in_range(random, -0.25, 0.25)));
  return scan;
}

/// The scan with a share of its ground points, those within 0.1 m of the ground of its map, too low.
cloud with_low_points(cloud scan, const stem_map& clean, double share, random_source& random) {
  const std::uint32_t one_in = std::uint32_t(1 / share);
  for (Vector3d& p : scan) {
    const vec3 local = clean.terrain.frame.to_local({p.x(), p.y(), p.z()});
    const auto height = clean.terrain.height_at(local.x, local.y);
    if (height && std::abs(local.z - *height) < 0.1 && random.below(one_in) == 0)
      p.z() -= in_range(random, 0.2, 1.5);
  }
  return scan;
}

struct outcome_of_scan {
  std::string scene, spoilt;
  std::uint64_t seed = 0;
  std::size_t station = 0, points = 0, stems = 0, true_finds = 0;
  stem_map map;
  std::vector<std::pair<std::size_t, double>> errors;  // of a stem of the map, [m] in height
};

outcome_of_scan score(stem_map map, std::size_t points, const std::vector<Vector3d>& truth,
                      const Eigen::Isometry3d& plot_from_scan) {
  outcome_of_scan result;
  std::vector<Vector3d> finds;
  for (const stem& s : map.stems) finds.push_back(plot_from_scan * s.position);
  result.points = points;
  result.stems = finds.size();
  for (const auto& [find, t] : pair_finds(finds, truth))
    result.errors.emplace_back(find, finds[find].z() - truth[t].z());
  result.true_finds = result.errors.size();
  result.map = std::move(map);
  return result;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

std::vector<double> absolute_errors(const outcome_of_scan& o) {
  std::vector<double> errors;
  for (const auto& [find, error] : o.errors) errors.push_back(std::abs(error));
  return errors;
}

void print_row(const outcome_of_scan& o) {
  std::cout << "| `" << o.scene << "`, " << o.seed << ", S" << o.station + 1 << " | " << o.spoilt << " | "
            << to_string(o.map.terrain.status) << (o.map.terrain.cut_off ? ", cut off | " : " | ") << o.stems
            << ", " << o.true_finds << std::fixed << std::setprecision(1) << " | "
            << 100 * quantile(absolute_errors(o), 0.95) << " |\n"
            << std::flush;
}

/// How often heights are within what stems say of them, by the ground points within a metre.
void print_calibration(const std::vector<outcome_of_scan>& all) {
  struct density_class {
    std::size_t from;
    std::vector<double> errors = {};
    std::size_t within_1 = 0, within_2 = 0;
    std::vector<double> sigmas = {};
  };
  std::vector<density_class> classes = {{30}, {20}, {12}, {8}, {4}, {1}, {0}};
  for (const outcome_of_scan& o : all)
    for (const auto& [find, error] : o.errors) {
      const stem& s = o.map.stems[find];
      auto& c = *std::find_if(classes.begin(), classes.end(),
                              [&](const auto& k) { return s.ground_points >= k.from; });
      c.errors.push_back(std::abs(error));
      c.sigmas.push_back(s.height_sigma);
      c.within_1 += std::abs(error) <= s.height_sigma;
      c.within_2 += std::abs(error) <= 2 * s.height_sigma;
    }
  std::cout
      << "\n| ground points within 1 m | stems | 68 %, 95 % of errors [cm] | median sigma [cm] | within "
         "one, two sigma [%] |\n|---|---|---|---|---|\n";
  for (const density_class& c : classes)
    std::cout << "| " << c.from << " and more | " << c.errors.size() << " | "
              << 100 * quantile(c.errors, 0.68) << ", " << 100 * quantile(c.errors, 0.95) << " | "
              << 100 * quantile(c.sigmas, 0.5) << " | " << 100 * double(c.within_1) / double(c.errors.size())
              << ", " << 100 * double(c.within_2) / double(c.errors.size()) << " |\n";
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Maps scans with low noise, or without ground, and scores heights.", "bad_scans");
  std::vector<std::string> names = {"plot_a_like", "plot_3", "underwood", "slope_15"};
  std::vector<std::uint64_t> seeds(std::begin(support::tuning_seeds), std::end(support::tuning_seeds));
  std::size_t stations = 2;
  std::vector<std::string> cases = {"none", "clump", "scattered", "cut"};
  double step = 0;
  std::filesystem::path csv_file;
  support::shared_options shared;
  app.add_option("--scenes", names, "names of scenes")->delimiter(',');
  app.add_option("--seeds", seeds, "of the scenes")->delimiter(',')->capture_default_str();
  app.add_option("--stations", stations, "of each plot")->capture_default_str();
  app.add_option("--cases", cases, "none, clump, scattered, cut")->delimiter(',');
  app.add_option("--angular-step", step, "instead of the scenes' own [deg]");
  app.add_option("--csv", csv_file, "file with a line for each true stem");
  shared.add_mapping_to(app);
  shared.add_threads_to(app);

  return support::run_program(app, argc, argv, [&] {
    const execution exec{.threads = shared.threads};
    const auto asked = [&](const char* name) {
      return std::find(cases.begin(), cases.end(), name) != cases.end();
    };
    std::vector<outcome_of_scan> all;
    std::cout
        << "| scene, seed, station | spoilt by | ground | stems, true ones | 95 % of height errors [cm] "
           "|\n|---|---|---|---|---|\n";
    for (const std::string& name : names)
      for (const std::uint64_t seed : seeds) {
        support::simulation_options options = support::find_scene(name).options;
        options.seed = seed;
        if (step > 0) options.scanner.angular_step = step;
        support::simulation plot(options);
        for (std::size_t i = 0; i < std::min(stations, plot.stations().size()); ++i) {
          const auto scan = plot.scan(i, exec);
          std::vector<Vector3d> truth;
          for (std::size_t s = 0; s < plot.plot().stems.size(); ++s)
            if (scan.returns_per_stem[s] >= 10) truth.push_back(plot.plot().stems[s].position);
          const auto run = [&](const std::string& spoilt, const cloud& points) {
            all.push_back(score(map_stems(points, shared.for_mapping(), Vector3d::UnitZ(), exec),
                                points.size(), truth, plot.stations()[i].plot_from_scan));
            all.back().scene = name, all.back().seed = seed, all.back().station = i;
            all.back().spoilt = spoilt;
            print_row(all.back());
          };
          random_source random(seed + 1000 * i);
          const stem_map clean = map_stems(scan.points, shared.for_mapping(), Vector3d::UnitZ(), exec);
          if (asked("none")) run("nothing", scan.points);
          if (asked("clump"))
            for (const double depth : {3.0, 10.0, 60.0})
              run("clump " + std::to_string(int(depth)) + " m below",
                  with_clump(scan.points, clean.ground_samples, depth, random));
          if (asked("scattered")) run("0.3 % too low", with_low_points(scan.points, clean, 0.003, random));
          if (asked("cut"))
            for (const double height : {1.0, 2.0, 3.0, 5.0})
              run("cut at " + std::to_string(int(height)) + " m", cut_below(scan.points, height));
        }
      }
    print_calibration(all);
    if (!csv_file.empty()) {
      support::atomic_file csv(csv_file);
      csv.stream() << "scene,seed,station,spoilt,status,stem,ground_points,sigma,error\n";
      for (const outcome_of_scan& o : all)
        for (const auto& [find, error] : o.errors)
          csv.stream() << o.scene << ',' << o.seed << ',' << o.station << ',' << o.spoilt << ','
                       << to_string(o.map.terrain.status) << ',' << find << ','
                       << o.map.stems[find].ground_points << ',' << o.map.stems[find].height_sigma << ','
                       << error << '\n';
      csv.commit();
    }
    return support::done;
  });
}

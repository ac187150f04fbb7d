// Time and success of `match_stems` against the number of stems, over layouts, and the exponent with which
// the time grows. Maps of half overlap (or another), 85 % of the stems detected, 10 % false.
#include <globalmatch/statistics.hpp>
#include <globalmatch/stem_matching.hpp>

#include "stem_layouts.hpp"
#include "support/atomic_file.hpp"
#include "support/command_line.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <string>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::benchmarks;

namespace {

struct measurement {
  double median_seconds = 0;
  std::size_t right = 0, wrong = 0;  // registered; the others are refused
};

double seconds_of(const auto& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void count(measurement& m, const matching& result, const two_maps& maps, double noise) {
  if (!result.target_from_source) return;
  const double error = largest_error(*result.target_from_source, maps.target_from_source, maps.source);
  ++(error < std::max(0.3, 3 * noise) ? m.right : m.wrong);
}

/// Slope of log(seconds) over log(stems).
double growth_exponent(const std::vector<std::pair<double, double>>& points) {
  double x = 0, y = 0, xx = 0, xy = 0;
  for (const auto& [stems, seconds] : points) {
    const double u = std::log(stems), v = std::log(seconds);
    x += u, y += v, xx += u * u, xy += u * v;
  }
  const double n = double(points.size());
  return (n * xy - x * y) / (n * xx - x * x);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Time and success of match_stems against the number of stems.", "matching_complexity");
  std::vector<std::string> layouts = {"random", "rows", "clumped"};
  std::vector<std::size_t> sizes = {200, 1000, 10000, 100000};
  std::size_t repetitions = 5;
  double overlap = 0.5;
  view_options view;
  std::string proposal_name = "index";
  std::size_t prepared_plot = 0;
  int threads = 0;
  std::filesystem::path csv_file = "matching_complexity.csv";
  app.add_option("--layouts", layouts, "random, rows, clumped")->delimiter(',');
  app.add_option("--sizes", sizes, "stems in each map")->delimiter(',');
  app.add_option("--repetitions", repetitions, "random pairs of maps of each kind")->capture_default_str();
  app.add_option("--overlap", overlap, "share of the area that both maps show")->capture_default_str();
  app.add_option("--noise", view.noise, "of coordinates [m]")->capture_default_str();
  app.add_option("--proposal", proposal_name, "index or algorithm_1")
      ->check(CLI::IsMember({"index", "algorithm_1"}))
      ->capture_default_str();
  app.add_option("--prepared", prepared_plot,
                 "match plots of so many stems against a prepared map, and time that alone");
  app.add_option("--threads", threads, "number of threads; 0: all")->capture_default_str();
  app.add_option("--csv", csv_file, "file for all times")->capture_default_str();

  return support::run_program(app, argc, argv, [&] {
    support::atomic_file csv(csv_file);
    csv.stream() << "layout,stems,repetition,seconds\n";
    matching_options options;
    if (proposal_name == "algorithm_1") {
      options.proposal = proposal::algorithm_1;
      options.tolerance = 0.05;
    }
    const execution how{.threads = threads};
    std::cout << "| layout | stems | median seconds | right, wrong, refused |\n|---|---|---|---|\n";
    for (const std::string& layout : layouts) {
      std::vector<std::pair<double, double>> growth;
      for (const std::size_t stems : sizes) {
        measurement m;
        std::vector<double> times;
        prepared_map prepared;
        two_maps forest;
        random_source random(stems);
        if (prepared_plot > 0) {
          forest = overlapping_maps(layout, stems, 1, view, random);
          prepared = prepare_map(forest.target, options, Eigen::Vector3d::UnitZ(), how);
        }
        for (std::size_t r = 0; r < repetitions; ++r) {
          two_maps maps;
          matching result;
          if (prepared_plot > 0) {
            maps.target_from_source = forest.target_from_source;
            const Eigen::Vector3d center = forest.source[random.below(std::uint32_t(forest.source.size()))];
            maps.source = forest.source;
            const auto nearer = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
              return (a - center).head<2>().norm() < (b - center).head<2>().norm();
            };
            std::partial_sort(maps.source.begin(), maps.source.begin() + std::ptrdiff_t(prepared_plot),
                              maps.source.end(), nearer);
            maps.source.resize(prepared_plot);
            times.push_back(seconds_of([&] {
              result = match_stems(maps.source, prepared, options, Eigen::Vector3d::UnitZ(), how);
            }));
          } else {
            maps = overlapping_maps(layout, stems, overlap, view, random);
            times.push_back(seconds_of([&] {
              result = match_stems(maps.source, maps.target, options, Eigen::Vector3d::UnitZ(), how);
            }));
          }
          count(m, result, maps, view.noise);
          csv.stream() << layout << ',' << stems << ',' << r << ',' << times.back() << '\n';
        }
        m.median_seconds = median(times);
        growth.push_back({double(stems), m.median_seconds});
        std::cout << "| " << layout << " | " << stems << " | " << std::setprecision(3) << m.median_seconds
                  << " | " << m.right << ", " << m.wrong << ", " << repetitions - m.right - m.wrong << " |\n"
                  << std::flush;
      }
      if (growth.size() > 1)
        std::cout << "| " << layout << " | growth exponent | " << std::setprecision(3)
                  << growth_exponent(growth) << " | |\n";
    }
    csv.commit();
    return support::done;
  });
}

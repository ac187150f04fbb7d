// How long does it take to refuse maps that have nothing in common, against registering maps as large that
// overlap by half? CPU time of one thread, in turn.
#include <globalmatch/stem_matching.hpp>

#include "stem_layouts.hpp"
#include "support/programs/command_line.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <ctime>
#include <iomanip>
#include <iostream>
#include <string>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::benchmarks;

namespace {

double cpu_milliseconds() {
  return 1e3 * double(std::clock()) / CLOCKS_PER_SEC;
}

struct row {
  double to_register = 0, to_refuse = 0;  // [ms] a pair
  std::size_t registered = 0, wrong = 0;
};

row measure(std::string_view layout, std::size_t stems, double noise, std::size_t pairs) {
  row sum;
  for (std::size_t i = 0; i < pairs; ++i) {
    random_source random(std::uint64_t(i + 1));
    const two_maps related = overlapping_maps(layout, stems, 0.5, {.noise = noise}, random),
                   other = overlapping_maps(layout, stems, 0.5, {.noise = noise}, random);
    const auto match = [&](const positions& target, double& milliseconds) {
      const double start = cpu_milliseconds();
      const matching result =
          match_stems(related.source, target, {}, Eigen::Vector3d::UnitZ(), {.threads = 1});
      milliseconds += (cpu_milliseconds() - start) / double(pairs);
      return result.outcome == outcome::registered;
    };
    sum.registered += match(related.target, sum.to_register);
    sum.wrong += match(other.target, sum.to_refuse);
  }
  return sum;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Compares the times to refuse and to register maps.", "refusal_times");
  std::vector<std::string> layouts = {"random", "spaced", "clumped", "rows"};
  std::vector<std::size_t> sizes = {20, 30, 50, 60, 100, 200, 1000};
  std::size_t pairs = 20;
  double noise = 0.02;
  app.add_option("--layouts", layouts, "how stems stand")->delimiter(',')->capture_default_str();
  app.add_option("--stems", sizes, "of each map")->delimiter(',')->capture_default_str();
  app.add_option("--pairs", pairs, "of each kind")->capture_default_str();
  app.add_option("--noise", noise, "of each coordinate [m]")->capture_default_str();
  return support::run_program(app, argc, argv, [&] {
    std::cout << std::setprecision(3)
              << "| layout | stems | register [ms] | refuse [ms] | ratio | registered of " << pairs
              << " | unrelated, registered |\n|---|---|---|---|---|---|---|\n";
    for (const std::string& layout : layouts)
      for (const std::size_t stems : sizes) {
        const row r = measure(layout, stems, noise, pairs);
        std::cout << "| " << layout << " | " << stems << " | " << r.to_register << " | " << r.to_refuse
                  << " | " << r.to_refuse / r.to_register << " | " << r.registered << " | " << r.wrong << " |"
                  << std::endl;
      }
    return support::done;
  });
}

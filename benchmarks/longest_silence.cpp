// How long does a run say nothing? Its progress callback is where it can be cancelled.
#include <globalmatch/registration.hpp>

#include "stem_layouts.hpp"
#include "support/programs/command_line.hpp"
#include "support/scan_files.hpp"

#include <chrono>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <string>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::detail;
using namespace globalmatch::benchmarks;

namespace {

/// Notes the longest time between two reports, or after the last one, and the stage that was at work.
class silence {
 public:
  execution listen(int threads) {
    execution exec;
    exec.threads = threads;
    exec.on_progress = [this](const progress& p) {
      note(p.stage);
      return true;
    };
    return exec;
  }
  void note(std::string_view next) {
    const auto now = clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    total_ += seconds;
    if (seconds > longest_) {
      longest_ = seconds;
      where_ = stage_ + " to " + std::string(next);
    }
    last_ = now;
    stage_ = next;
  }
  void print(const std::string& what) {
    note("the end");
    std::cout << "| " << what << " | " << std::setprecision(3) << total_ << " | " << longest_ << " | "
              << where_ << " |\n"
              << std::flush;
  }

 private:
  using clock = std::chrono::steady_clock;
  clock::time_point last_ = clock::now();
  double longest_ = 0, total_ = 0;
  std::string stage_ = "the start", where_;
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Longest time [s] in which a run cannot be cancelled.", "longest_silence");
  std::vector<std::filesystem::path> scans;
  std::vector<std::size_t> sizes = {1000, 100000, 1000000};
  int threads = 0;
  app.add_option("SCAN", scans, "scans to map");
  app.add_option("--sizes", sizes, "stems in each map to match")->delimiter(',')->capture_default_str();
  app.add_option("--threads", threads, "number of threads; 0: all")->capture_default_str();

  return support::run_program(app, argc, argv, [&] {
    const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
    std::cout << "| run | seconds | longest silence | where |\n|---|---|---|---|\n";
    for (const char* layout : {"random", "rows", "clumped"})
      for (const std::size_t stems : sizes) {
        random_source random(1);
        const two_maps maps = overlapping_maps(layout, stems, 0.5, {}, random);
        silence s;
        match_stems(maps.source, maps.target, {}, up, s.listen(threads));
        s.print(std::string("match_stems, ") + layout + ", " + std::to_string(stems));
      }
    for (const char* layout : {"random", "rows"}) {
      random_source random(1);
      const two_maps maps = overlapping_maps(layout, 1000, 0.5, {}, random);
      matching_options exact;
      exact.proposal = proposal::algorithm_1;
      silence s;
      match_stems(maps.source, maps.target, exact, up, s.listen(threads));
      s.print(std::string("algorithm_1, ") + layout + ", 1000");
    }
    for (const auto& file : scans) {
      const support::scan_file scan = support::open_scan(file);
      silence s;
      const stem_map map = map_stems(scan, {}, up, s.listen(threads));
      s.print("map_stems, " + std::to_string(scan.size()) + " points");
      silence of_maps;
      register_maps(map, map, {}, of_maps.listen(threads));
      of_maps.print("register_maps of it with itself");
    }
    return support::done;
  });
}

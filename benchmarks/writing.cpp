// How fast are scans written as PLY, LAS and LAZ with their attributes, and in how much memory? CPU and wall
// time, reading included; files are written to the folder of temporary files.
#include "peak_memory.hpp"
#include "support/programs/command_line.hpp"
#include "support/scan_writer.hpp"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <limits>
#include <vector>

using namespace globalmatch;

namespace {

struct result {
  double cpu = std::numeric_limits<double>::infinity(), wall = cpu;  // [s], each the best
  double megabytes = 0;                                              // more than before, at most
};

result measure(const support::scan_file& scan, const std::filesystem::path& out, int threads,
               int repetitions) {
  using clock = std::chrono::steady_clock;
  const support::placed_scan placed{&scan, Eigen::Isometry3d::Identity(), {}};
  result r;
  benchmarks::reset_peak_memory();
  const double before = benchmarks::peak_memory();
  for (int k = 0; k < repetitions; ++k) {
    const auto wall = clock::now();
    const std::clock_t cpu = std::clock();
    support::write_scans(out, {&placed, 1}, threads);
    r.cpu = std::min(r.cpu, double(std::clock() - cpu) / CLOCKS_PER_SEC);
    r.wall = std::min(r.wall, std::chrono::duration<double>(clock::now() - wall).count());
  }
  r.megabytes = benchmarks::peak_memory() - before;
  return r;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Measures how fast scans are written.", "writing");
  std::vector<std::filesystem::path> files;
  std::vector<int> thread_counts = {1, 2};
  int repetitions = 5;
  app.add_option("SCAN", files, "files of points")->required();
  app.add_option("--threads", thread_counts, "numbers of threads")->delimiter(',')->capture_default_str();
  app.add_option("--repetitions", repetitions, "of which the best counts")->capture_default_str();
  return support::run_program(app, argc, argv, [&] {
    std::cout << std::setprecision(3)
              << "| file | written as | threads | million points | million points a CPU second, a second | "
                 "[MB] | peak [MB] |\n|---|---|---|---|---|---|---|\n";
    for (const auto& file : files)
      for (const char* extension : {".ply", ".las", ".laz"})
        for (const int threads : thread_counts) {
          const auto scan =
              support::open_scan(file, {.keep_marked = true, .attributes = true, .threads = threads});
          const auto out =
              std::filesystem::temp_directory_path() / (std::string("globalmatch_writing") + extension);
          const result r = measure(scan, out, threads, repetitions);
          const double million = double(scan.size()) / 1e6;
          std::cout << "| `" << file.filename().string() << "` | " << extension << " | " << threads << " | "
                    << million << " | " << million / r.cpu << ", " << million / r.wall << " | "
                    << double(std::filesystem::file_size(out)) / 1e6 << " | " << r.megabytes << " |\n"
                    << std::flush;
          std::filesystem::remove(out);
        }
    return support::done;
  });
}

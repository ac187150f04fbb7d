// How fast are scan files read, and what does a map cost from a file against from memory? CPU and wall time,
// in turn, best of several. Beside each file its bytes alone, and with GLOBALMATCH_BENCHMARK_PCL what PCL
// takes to read it.
#include <globalmatch/detail/core/threads.hpp>
#include <globalmatch/stem_mapping.hpp>

#include "pcl_readers.hpp"
#include "peak_memory.hpp"
#include "support/file_bytes.hpp"
#include "support/programs/command_line.hpp"
#include "support/scan_files.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <ctime>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <limits>
#include <memory>
#include <string>
#include <vector>

using namespace globalmatch;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

struct times {
  double cpu = infinity, wall = infinity;  // [s], each the best so far
};

template <class Work>
void measure(times& best, const Work& work) {
  using clock = std::chrono::steady_clock;
  const auto wall = clock::now();
  const std::clock_t cpu = std::clock();
  work();
  best.cpu = std::min(best.cpu, double(std::clock() - cpu) / CLOCKS_PER_SEC);
  best.wall = std::min(best.wall, std::chrono::duration<double>(clock::now() - wall).count());
}

// Opens a scan and passes all of its points, as mapping does.
std::size_t read_all(const std::filesystem::path& file, const support::scan_options& options) {
  const support::scan_file scan = support::open_scan(file, options);
  std::atomic<std::size_t> finite = 0;
  detail::parallel_chunks({.threads = options.threads}, "read", scan.size(), 16384,
                          [&](std::size_t begin, std::size_t end) {
                            auto at = scan.begin() + static_cast<std::ptrdiff_t>(begin);
                            std::size_t here = 0;
                            for (std::size_t i = begin; i < end; ++i, ++at) here += (*at).allFinite();
                            finite += here;
                          });
  return finite;
}

// The bytes of a file without any use of them: what reading costs that cannot be less.
void read_bytes(const std::filesystem::path& path, int threads) {
  constexpr std::size_t block_size = std::size_t(1) << 20;
  const support::file_bytes file(path);
  detail::parallel_chunks(
      {.threads = threads}, "read", file.size(), block_size, [&](std::size_t begin, std::size_t end) {
        static thread_local const auto block = std::make_unique_for_overwrite<char[]>(block_size);
        file.read(begin, {block.get(), end - begin});
      });
}

struct result {
  std::size_t points = 0;
  times bytes, read, map_file, map_memory;
  double megabytes = 0;  // of anonymous memory, more than before, at most, while the file is mapped
};

result measure(const std::filesystem::path& file, int threads, int repetitions) {
  const support::scan_options options{.threads = threads};
  const execution exec{.threads = threads};
  const auto map_file = [&] { map_stems(support::open_scan(file, options), {}, {0, 0, 1}, exec); };
  result r;
  benchmarks::reset_peak_memory();
  benchmarks::anonymous_memory memory;
  map_file();
  r.megabytes = memory.peak();
  for (int k = 0; k < repetitions; ++k) {
    measure(r.bytes, [&] { read_bytes(file, threads); });
    measure(r.read, [&] { r.points = read_all(file, options); });
    measure(r.map_file, map_file);
    const support::scan_file scan = support::open_scan(file, options);
    const std::vector<Eigen::Vector3d> points(scan.begin(), scan.end());
    measure(r.map_memory, [&] { map_stems(points, {}, {0, 0, 1}, exec); });
  }
  return r;
}

std::ostream& row(const std::filesystem::path& file, const std::string& by, int threads) {
  return std::cout << "| `" << file.filename().string() << "`" << by << " | " << threads << " | ";
}

void print(const std::filesystem::path& file, int threads, const result& r) {
  const double million = double(r.points) / 1e6, bytes = double(std::filesystem::file_size(file)) / 1e6;
  row(file, ", bytes alone", threads)
      << "| , " << bytes / r.bytes.cpu << ", , " << bytes / r.bytes.wall << " | | | | |\n";
  row(file, "", threads) << million << " | " << million / r.read.cpu << ", " << bytes / r.read.cpu << ", "
                         << million / r.read.wall << ", " << bytes / r.read.wall << " | " << r.map_file.cpu
                         << ", " << r.map_file.wall << " | " << r.map_memory.cpu << ", " << r.map_memory.wall
                         << " | " << r.map_file.cpu / r.map_memory.cpu << " | " << r.megabytes << " |\n"
                         << std::flush;
}

// What PCL takes, which reads on one thread and keeps all points.
void print_pcl(const std::filesystem::path& file, int repetitions) {
  if (!benchmarks::pcl_reads(file)) return;
  const double bytes = double(std::filesystem::file_size(file)) / 1e6;
  times best;
  double million = 0, megabytes = 0;
  for (int k = 0; k < repetitions; ++k) {
    benchmarks::reset_peak_memory();
    benchmarks::anonymous_memory memory;
    measure(best, [&] { million = double(benchmarks::read_by_pcl(file)) / 1e6; });
    megabytes = memory.peak();
  }
  row(file, ", by PCL", 1) << million << " | " << million / best.cpu << ", " << bytes / best.cpu << ", "
                           << million / best.wall << ", " << bytes / best.wall << " | | | | " << megabytes
                           << " |\n"
                           << std::flush;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Measures how fast scan files are read and mapped.", "reading");
  std::vector<std::filesystem::path> files;
  std::vector<int> thread_counts = {1, 2};
  int repetitions = 5;
  app.add_option("SCAN", files, "files of points")->required();
  app.add_option("--threads", thread_counts, "numbers of threads")->delimiter(',')->capture_default_str();
  app.add_option("--repetitions", repetitions, "of which the best counts")->capture_default_str();
  return support::run_program(app, argc, argv, [&] {
    std::cout
        << std::setprecision(3)
        << "| file | threads | million points | read: million points, MB a CPU second, a second | map: CPU "
           "s, s | from memory: CPU s, s | CPU ratio | peak of anonymous memory [MB] "
           "|\n|---|---|---|---|---|---|---|---|\n";
    for (const auto& file : files) {
      for (const int threads : thread_counts) print(file, threads, measure(file, threads, repetitions));
      print_pcl(file, repetitions);
    }
    return support::done;
  });
}

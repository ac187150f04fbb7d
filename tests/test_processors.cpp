#include "globalmatch/detail/core/processors.hpp"

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <thread>

#ifdef __linux__
#include <sched.h>
#endif

#include "catch.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "support/message_of.hpp"

namespace globalmatch::detail::test_processors {

using support::message_of;
using clock = std::chrono::steady_clock;

TEST_CASE("a negative number of threads is refused") {
  const execution exec{.threads = -1};
  CHECK(message_of([&] { require_valid(exec); }).starts_with("execution.threads"));
  CHECK(message_of([&] { thread_count(exec); }).starts_with("execution.threads"));
  CHECK(message_of([&] {
          parallel_chunks(exec, "none", 5, 1, [](std::size_t, std::size_t) {});
        }).starts_with("execution.threads"));
}

TEST_CASE("thread_count is what was asked for, or at least one, and at most 1024") {
  CHECK(thread_count({}) >= 1);
  CHECK(thread_count({.threads = 1}) == 1);
  CHECK(thread_count({.threads = 5}) == 5);
  CHECK(thread_count({.threads = 100'000}) == 1024);
}

TEST_CASE("the quota of control groups is the smallest of the groups around the process, rounded up") {
  namespace fs = std::filesystem;
  const fs::path root = fs::temp_directory_path() /
                        ("globalmatch_quota_" + std::to_string(clock::now().time_since_epoch().count()));
  const auto write = [&](const char* path, const char* text) {
    fs::create_directories((root / path).parent_path());
    std::ofstream(root / path) << text;
  };
  constexpr int none = std::numeric_limits<int>::max();
  CHECK(cpu_quota(root.string()) == none);
  write("proc/self/cgroup", "0::/user/session\n");
  CHECK(cpu_quota(root.string()) == none);
  write("sys/fs/cgroup/user/session/cpu.max", "max 100000\n");
  CHECK(cpu_quota(root.string()) == none);
  write("sys/fs/cgroup/user/cpu.max", "250000 100000\n");
  CHECK(cpu_quota(root.string()) == 3);
  write("sys/fs/cgroup/user/session/cpu.max", "100000 100000\n");
  CHECK(cpu_quota(root.string()) == 1);
  write("sys/fs/cgroup/user/session/cpu.max", "1000 100000\n");
  CHECK(cpu_quota(root.string()) == 1);
  write("proc/self/cgroup", "0::/\n");
  CHECK(cpu_quota(root.string()) == none);
  write("sys/fs/cgroup/cpu.max", "400000 100000\n");
  CHECK(cpu_quota(root.string()) == 4);

  write("proc/self/cgroup", "3:cpuset:/a\n2:cpu,cpuacct:/docker/1\n");
  CHECK(cpu_quota(root.string()) == none);
  write("sys/fs/cgroup/cpu/cpu.cfs_quota_us", "-1\n");
  write("sys/fs/cgroup/cpu/cpu.cfs_period_us", "50000\n");
  CHECK(cpu_quota(root.string()) == none);
  write("sys/fs/cgroup/cpu/cpu.cfs_quota_us", "75000\n");
  CHECK(cpu_quota(root.string()) == 2);
  fs::remove_all(root);
}

TEST_CASE("a control group limits processors where its line names no controllers, or cpu among them") {
  const auto mount_of = [](const char* line) { return control_group(line).mount; };
  CHECK(mount_of("0::/user") == "/sys/fs/cgroup");
  CHECK(mount_of("4:cpu:/a") == "/sys/fs/cgroup/cpu");
  CHECK(mount_of("4:cpuacct,cpu:/a") == "/sys/fs/cgroup/cpu");
  CHECK(mount_of("4:cpu,cpuacct:/a") == "/sys/fs/cgroup/cpu");
  CHECK(mount_of("3:cpuset:/a").empty());
  CHECK(mount_of("3:memory,cpuset:/a").empty());
  CHECK(mount_of("no group").empty());
  CHECK(mount_of("one:colon").empty());
  CHECK(mount_of("").empty());
  CHECK(control_group("4:cpuacct,cpu:/a/b:c").path == "/a/b:c");
}

TEST_CASE("a file that cannot be read is empty") {
  CHECK(read_small_file("/nowhere/to/be/found").empty());
}

#ifdef __linux__
TEST_CASE("threads = 0 heeds the affinity mask") {
  cpu_set_t before;
  REQUIRE(sched_getaffinity(0, sizeof before, &before) == 0);
  int first = 0;
  while (!CPU_ISSET(first, &before)) ++first;
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(first, &one);
  REQUIRE(sched_setaffinity(0, sizeof one, &one) == 0);
  const int pinned = thread_count({});
  REQUIRE(sched_setaffinity(0, sizeof before, &before) == 0);
  CHECK(pinned == 1);
  CHECK(thread_count({}) <= CPU_COUNT(&before));
  CHECK(thread_count({}) <= int(std::thread::hardware_concurrency()));
}
#endif

}  // namespace globalmatch::detail::test_processors

#include "support/stage_lock.hpp"

#include <atomic>
#include <chrono>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "catch.hpp"
#include "support/file_error.hpp"
#include "support/process_identity.hpp"
#include "temporary_directory.hpp"

namespace globalmatch::support::test_stage_lock {

using namespace std::chrono_literals;

namespace {
constexpr stage_lock::timing quick = {.heartbeat = 5ms, .stale = 400ms, .poll = 5ms};
}

TEST_CASE("a lock names host, process and start, and leaves nothing behind") {
  const temporary_directory directory;
  {
    const stage_lock lock(directory / "a.lock");
    const process_identity own = process_identity::own();
    const std::string content = bytes_of(directory / "a.lock");
    CHECK(content.starts_with(own.host + "\n" + std::to_string(own.process) + "\n20"));
    const stage_lock other(directory / "b.lock");
    CHECK(directory.count_files() == 2);
  }
  CHECK(directory.count_files() == 0);
  CHECK_THROWS_AS(stage_lock(directory / "absent/a.lock"), file_error);
}

TEST_CASE("who finds a lock whose heart beats waits until it is gone") {
  const temporary_directory directory;
  auto held = std::make_unique<stage_lock>(directory / "a.lock", quick);
  std::atomic<bool> is_free = false, was_early = false;
  std::thread other([&] {
    const stage_lock lock(directory / "a.lock", quick);
    was_early = !is_free;
  });
  std::this_thread::sleep_for(3 * quick.stale);
  is_free = true;
  held.reset();
  other.join();
  CHECK_FALSE(was_early);
  CHECK(directory.count_files() == 0);
}

TEST_CASE("a lock without a heartbeat, of a process that has ended, or that says nothing, is taken") {
  const temporary_directory directory;
  const std::string host = process_identity::own().host;
  for (const std::string& content : {std::string("elsewhere\n12\n2026-01-01T00:00:00Z\n1\n"),
                                     host + "\n999999999\n2026-01-01T00:00:00Z\n1\n", std::string()}) {
    directory.file("a.lock", content);
    const stage_lock lock(directory / "a.lock", quick);
    CHECK(bytes_of(directory / "a.lock").starts_with(host));
  }
  CHECK(directory.count_files() == 0);
}

TEST_CASE("a lock that another process has taken is left to that") {
  const temporary_directory directory;
  const std::string other = "elsewhere\n12\n2026-01-01T00:00:00Z\n1\n";
  {
    const stage_lock lock(directory / "a.lock", quick);
    do {  // the owner may have looked at its file just before, and write it once more
      directory.file("a.lock", other);
      std::this_thread::sleep_for(10 * quick.heartbeat);
    } while (bytes_of(directory / "a.lock") != other);
  }
  CHECK(bytes_of(directory / "a.lock") == other);
}

}  // namespace globalmatch::support::test_stage_lock

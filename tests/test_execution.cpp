#include "globalmatch/execution.hpp"

#include <atomic>
#include <cmath>
#include <string>
#include <thread>
#include <vector>

#include "catch.hpp"
#include "support/message_of.hpp"

namespace globalmatch {

using support::message_of;

namespace {

/// Sum over chunks of numbers whose order of summation matters.
double chunked_sum(int threads, std::size_t count) {
  constexpr std::size_t chunk = 7;
  std::vector<double> sums((count + chunk - 1) / chunk);
  parallel_chunks({.threads = threads}, "sum", count, chunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) sums[begin / chunk] += 1 / std::pow(double(i + 1), 1.5);
  });
  double total = 0;
  for (const double s : sums) total += s;
  return total;
}

}  // namespace

TEST_CASE("parallel_chunks gives the same bits for 1, 2 and 8 threads") {
  const double alone = chunked_sum(1, 10001);
  CHECK(alone == Approx(2.592375));
  CHECK(chunked_sum(2, 10001) == alone);
  CHECK(chunked_sum(8, 10001) == alone);
  CHECK(chunked_sum(0, 10001) == alone);
}

TEST_CASE("parallel_chunks covers every index once, in chunks of the size asked for, the last one shorter") {
  for (const std::size_t count : {1u, 99u, 100u, 101u, 250u}) {
    CAPTURE(count);
    std::vector<std::atomic<int>> visits(count);
    std::atomic<bool> sizes_right = true;
    parallel_chunks({.threads = 2}, "visit", count, 100, [&](std::size_t begin, std::size_t end) {
      if (begin % 100 != 0 || end != std::min(begin + 100, count)) sizes_right = false;
      for (std::size_t i = begin; i < end; ++i) ++visits[i];
    });
    CHECK(sizes_right);
    CHECK(std::count(visits.begin(), visits.end(), 1) == std::ptrdiff_t(count));
  }
}

TEST_CASE("parallel_for calls the work once for every index") {
  std::vector<std::atomic<int>> visits(1000);
  parallel_for(
      {.threads = 2}, "visit", visits.size(), [&](std::size_t i) { ++visits[i]; }, 3);
  CHECK(std::count(visits.begin(), visits.end(), 1) == 1000);
}

TEST_CASE("parallel_chunks over nothing names its stage and does no work") {
  int reports = 0;
  const execution exec{.on_progress = [&](const progress& p) { return ++reports > 0 && p.fraction == 0; }};
  CHECK_NOTHROW(parallel_chunks(exec, "none", 0, 10,
                                [](std::size_t, std::size_t) { throw std::logic_error("called"); }));
  CHECK(reports == 1);
}

TEST_CASE("parallel_chunks rethrows the first exception in chunk order") {
  for (const int threads : {1, 2, 8}) {
    std::string what;
    int others = 0;
    for (int repetition = 0; repetition < 100; ++repetition) {
      try {
        parallel_for(
            {.threads = threads}, "throw", 64,
            [](std::size_t i) {
              if (i >= 3) throw std::runtime_error(std::to_string(i));
            },
            1);
      } catch (const std::runtime_error& error) {
        others += std::string(error.what()) == "3" ? 0 : 1;
      }
    }
    CAPTURE(threads);
    CHECK(others == 0);
  }
}

TEST_CASE("parallel_chunks waits for a chunk at work that comes before the one that failed") {
  for (const int threads : {1, 2, 8}) {
    std::atomic<bool> finished = false;
    const auto run = [&] {
      parallel_for(
          {.threads = threads}, "wait", 8,
          [&](std::size_t i) {
            if (i > 0) throw std::runtime_error("a later chunk");
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
            finished = true;
            throw std::invalid_argument("the first chunk");
          },
          1);
    };
    CAPTURE(threads);
    CHECK(message_of(run) == "the first chunk");
    CHECK(finished);
  }
}

TEST_CASE("parallel_chunks starts no further chunks once one has failed") {
  std::atomic<int> calls = 0;
  CHECK_THROWS(parallel_for(
      {.threads = 1}, "stop", 1000,
      [&](std::size_t i) {
        ++calls;
        if (i == 4) throw std::runtime_error("stop");
      },
      1));
  CHECK(calls == 5);
}

TEST_CASE("progress is reported on the calling thread, from 0 on, with the stage and a growing share") {
  for (const int threads : {1, 2, 8}) {
    CAPTURE(threads);
    const auto caller = std::this_thread::get_id();
    bool elsewhere = false, misnamed = false, out_of_order = false;
    double last = -1;
    int reports = 0;
    const execution exec{.threads = threads, .on_progress = [&](const progress& p) {
                           ++reports;
                           elsewhere |= std::this_thread::get_id() != caller;
                           misnamed |= p.stage != "counting";
                           out_of_order |=
                               reports == 1 ? p.fraction != 0 : p.fraction <= last || p.fraction > 1;
                           last = p.fraction;
                           return true;
                         }};
    parallel_chunks(exec, "counting", 100, 1, [](std::size_t, std::size_t) {
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    });
    CHECK(reports >= 1);
    CHECK_FALSE(elsewhere);
    CHECK_FALSE(misnamed);
    CHECK_FALSE(out_of_order);
    if (threads == 1) {
      CHECK(reports == 101);
      CHECK(last == 1);
    }
  }
}

TEST_CASE("a progress callback that returns false cancels what is left") {
  std::atomic<int> calls = 0;
  const execution exec{.threads = 1, .on_progress = [&](const progress& p) { return p.fraction < 0.3; }};
  CHECK_THROWS_AS(parallel_chunks(exec, "cancel", 100, 10, [&](std::size_t, std::size_t) { ++calls; }),
                  operation_cancelled);
  CHECK(calls == 3);
  const execution at_once{.threads = 1, .on_progress = [](const progress&) { return false; }};
  CHECK_THROWS_AS(parallel_chunks(at_once, "cancel", 100, 10, [&](std::size_t, std::size_t) { ++calls; }),
                  operation_cancelled);
  CHECK(calls == 3);
  CHECK_THROWS_AS(report_progress(exec, "cancel", 0.5), operation_cancelled);
  CHECK_NOTHROW(report_progress(exec, "go on", 0.1));
  CHECK_NOTHROW(report_progress({}, "nobody listens", 0.1));
}

TEST_CASE("an exception from the progress callback reaches the caller") {
  const execution exec{.threads = 2, .on_progress = [](const progress&) -> bool {
                         throw std::invalid_argument("from the callback");
                       }};
  CHECK(message_of([&] {
          parallel_chunks(exec, "throw", 100, 1, [](std::size_t, std::size_t) {
            std::this_thread::sleep_for(std::chrono::microseconds(100));
          });
        }) == "from the callback");
}

TEST_CASE("a negative number of threads is refused") {
  const execution exec{.threads = -1};
  CHECK(message_of([&] { require_valid(exec); }).starts_with("execution.threads"));
  CHECK(message_of([&] { thread_count(exec); }).starts_with("execution.threads"));
  CHECK(message_of([&] {
          parallel_chunks(exec, "none", 5, 1, [](std::size_t, std::size_t) {});
        }).starts_with("execution.threads"));
}

TEST_CASE("thread_count is what was asked for, or at least one") {
  CHECK(thread_count({}) >= 1);
  CHECK(thread_count({.threads = 1}) == 1);
#ifdef _OPENMP
  CHECK(thread_count({.threads = 5}) == 5);
#else
  CHECK(thread_count({.threads = 5}) == 1);
#endif
}

#ifdef _OPENMP
TEST_CASE("the number of threads of the process stays as it was") {
  const int before = omp_get_max_threads();
  chunked_sum(before + 3, 1000);
  CHECK(omp_get_max_threads() == before);
}
#endif

}  // namespace globalmatch

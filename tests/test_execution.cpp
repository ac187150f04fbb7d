#include "globalmatch/execution.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "catch.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "loops.hpp"
#include "support/message_of.hpp"

namespace globalmatch::detail::test_execution {

using loops::chunked_sum;
using loops::clock;
using loops::milliseconds;
using loops::seconds_since;
using loops::this_thread_alone;
using loops::threads_of_loop;
using loops::work_for;
using support::message_of;

TEST_CASE("a cancelled operation is a runtime error that says who cancelled it") {
  CHECK_THROWS_WITH(throw operation_cancelled(), "cancelled by the progress callback");
  CHECK_THROWS_AS(throw operation_cancelled(), std::runtime_error);
  CHECK(execution{}.threads == 0);
  CHECK_FALSE(execution{}.on_progress);
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
                               reports == 1 ? p.fraction != 0 : p.fraction < last || p.fraction > 1;
                           last = p.fraction;
                           return true;
                         }};
    parallel_chunks(exec, "counting", 100, 1, [](std::size_t, std::size_t) {
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    });
    CHECK(reports >= 2);
    CHECK_FALSE(elsewhere);
    CHECK_FALSE(misnamed);
    CHECK_FALSE(out_of_order);
    CHECK(last == 1);
    if (threads == 1) CHECK(reports == 101);
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

TEST_CASE("threads are never more than chunks, and 100,000 asked for is fine") {
  CHECK(threads_of_loop({.threads = 100'000}, 1) == this_thread_alone());
  CHECK(threads_of_loop({.threads = 100'000}, 5).size() <= 5);
  CHECK(threads_of_loop({.threads = 100'000}, 5).size() >= 2);
  const double alone = chunked_sum(1, 10001);
  CHECK(chunked_sum(100'000, 10001) == alone);
  CHECK(threads_of_loop({.threads = 1}, 5) == this_thread_alone());
}

TEST_CASE("a loop in the progress callback runs on the calling thread") {
  std::set<std::thread::id> threads;
  const execution exec{.threads = 2, .on_progress = [&](const progress&) {
                         threads.merge(threads_of_loop({.threads = 4}, 4));
                         return true;
                       }};
  parallel_for(
      exec, "outer", 4, [](std::size_t) {}, 1);
  CHECK(threads == this_thread_alone());
  threads.clear();
  report_progress(exec, "no loop", 0);
  CHECK(threads == this_thread_alone());
  CHECK(threads_of_loop({.threads = 3}, 30).size() == 3);  // afterwards all is as before
}

TEST_CASE(
    "the callback is asked every 50 ms while another thread works on a long chunk, which it can cancel") {
  for (const bool long_on_caller : {false, true}) {
    CAPTURE(long_on_caller);
    const auto caller = std::this_thread::get_id();
    const auto start = clock::now();
    double last = 0, longest_silence = 0;
    int reports = 0;
    const execution exec{.threads = 2, .on_progress = [&](const progress&) {
                           const double now = seconds_since(start);
                           longest_silence = std::max(longest_silence, now - std::exchange(last, now));
                           ++reports;
                           return now < 0.4;
                         }};
    std::atomic<bool> cancelled = false;
    const auto work = [&](std::size_t) {
      if ((std::this_thread::get_id() == caller) != long_on_caller) {
        work_for(milliseconds(5));
        return;
      }
      try {
        while (seconds_since(start) < 20) poll_cancelled();
      } catch (const operation_cancelled&) {
        cancelled = true;
        throw;
      }
    };
    CHECK_THROWS_AS(parallel_for(exec, "long", 4, work, 1), operation_cancelled);
    CHECK(cancelled);
    CHECK(seconds_since(start) < 10);
    CHECK(reports >= 4);
    CHECK(reports <= 16);
    CHECK(longest_silence < 5);
  }
}

}  // namespace globalmatch::detail::test_execution

#include "globalmatch/detail/core/threads.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#ifdef __linux__
#include <pthread.h>
#endif

#include "catch.hpp"
#include "loops.hpp"
#include "support/message_of.hpp"

namespace globalmatch::detail::test_threads {

using loops::chunked_sum;
using loops::clock;
using loops::milliseconds;
using loops::seconds_since;
using loops::this_thread_alone;
using loops::threads_of_loop;
using loops::work_for;
using support::message_of;

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

TEST_CASE("loops run in parallel, and the calling thread works too") {
  const auto threads = threads_of_loop({.threads = 3}, 30);
  CHECK(threads.size() == 3);
  CHECK(threads.count(std::this_thread::get_id()) == 1);
}

TEST_CASE("short loops start no threads") {
  int shortest = 99;
  for (int attempt = 0; attempt < 20; ++attempt) {  // the system may hold up any of them
    std::mutex mutex;
    std::set<std::thread::id> threads;
    parallel_for(
        {.threads = 4}, "short", 20,
        [&](std::size_t) {
          const std::lock_guard lock(mutex);
          threads.insert(std::this_thread::get_id());
        },
        1);
    shortest = std::min(shortest, int(threads.size()));
  }
  CHECK(shortest == 1);
}

TEST_CASE("loops of a scope share its threads") {
  const execution exec{.threads = 3};
  const parallel_scope scope(exec, "outer");
  std::set<std::thread::id> threads;
  for (int i = 0; i < 20; ++i) threads.merge(threads_of_loop(exec, 4));
  CHECK(threads.size() >= 2);
  CHECK(threads.size() <= 3);
  {
    const parallel_scope inner(exec, "inner");
    threads.merge(threads_of_loop(exec, 4));
    CHECK(threads.size() <= 3);
  }
  threads.merge(threads_of_loop({.threads = 2}, 4));
  CHECK(threads.size() <= 3);
  CHECK(threads_of_loop({.threads = 2}, 20).size() == 2);
  CHECK(threads_of_loop({.threads = 5}, 60).size() == 5);
}

TEST_CASE("many short loops in a scope give the same sums with threads that come late") {
  const execution exec{.threads = 4};
  const double alone = chunked_sum(1, 100);
  const parallel_scope scope(exec, "outer");
  int others = 0;
  for (int i = 0; i < 3000; ++i) others += chunked_sum(2 + i % 3, 100) == alone ? 0 : 1;
  CHECK(others == 0);
}

TEST_CASE("loops of several threads that call at once do not disturb each other") {
  const double alone = chunked_sum(1, 1000);
  std::atomic<int> others = 0;
  std::vector<std::thread> callers;
  for (int i = 0; i < 4; ++i)
    callers.emplace_back([&] {
      for (int j = 0; j < 50; ++j) others += chunked_sum(3, 1000) == alone ? 0 : 1;
    });
  for (std::thread& caller : callers) caller.join();
  CHECK(others == 0);
}

TEST_CASE("a loop in a chunk runs on the chunk's thread") {
  for (const int threads : {1, 2, 3}) {
    CAPTURE(threads);
    std::atomic<int> elsewhere = 0;
    parallel_for(
        {.threads = threads}, "outer", 6,
        [&](std::size_t) {
          const execution exec{.threads = 4};
          const parallel_scope scope(exec, "inner");
          if (threads_of_loop(exec, 4) != this_thread_alone()) ++elsewhere;
        },
        1);
    CHECK(elsewhere == 0);
  }
  std::set<std::thread::id> below_one_chunk;
  parallel_for({.threads = 2}, "outer", 1,
               [&](std::size_t) { below_one_chunk = threads_of_loop({.threads = 3}, 30); });
  CHECK(below_one_chunk.size() == 3);
}

TEST_CASE("an exception from the callback while chunks are at work reaches the caller as it is") {
  for (const int threads : {1, 2}) {
    int reports = 0;
    std::atomic<int> left = 0;
    const execution exec{.threads = threads, .on_progress = [&](const progress&) {
                           if (++reports == 2) throw std::invalid_argument("from the callback");
                           return true;
                         }};
    const auto work = [&](std::size_t) {
      try {
        for (const auto start = clock::now(); seconds_since(start) < 20;) poll_cancelled();
      } catch (...) {
        ++left;
        throw;
      }
    };
    CAPTURE(threads);
    CHECK(message_of([&] { parallel_for(exec, "long", 8, work, 1); }) == "from the callback");
    CHECK(left == threads);
  }
}

TEST_CASE("work that swallows what the callback throws is cancelled all the same") {
  int calls = 0;
  const execution exec{.threads = 1, .on_progress = [&](const progress&) { return ++calls == 1; }};
  int chunks = 0;
  const auto work = [&](std::size_t) {
    ++chunks;
    try {
      for (const auto start = clock::now(); seconds_since(start) < 20;) poll_cancelled();
    } catch (...) {
      return;
    }
  };
  CHECK_THROWS_AS(parallel_for(exec, "long", 8, work, 1), operation_cancelled);
  CHECK(chunks == 1);
  CHECK(calls == 2);
}

TEST_CASE("a long chunk is left when an earlier one failed") {
  std::atomic<bool> left = false, begun = false;
  const auto start = clock::now();
  const auto work = [&](std::size_t i) {
    if (i == 0) {
      while (!begun && seconds_since(start) < 20) poll_cancelled();  // has a thread started
      throw std::invalid_argument("the first chunk");
    }
    begun = true;
    try {
      while (seconds_since(start) < 20) poll_cancelled();
    } catch (const operation_cancelled&) {
      left = true;
      throw;
    }
  };
  CHECK(message_of([&] { parallel_for({.threads = 2}, "long", 2, work, 1); }) == "the first chunk");
  CHECK(left);
  CHECK(seconds_since(start) < 10);
}

TEST_CASE("a nested loop on another thread is left when the outer one is cancelled") {
  const auto caller = std::this_thread::get_id();
  const auto start = clock::now();
  const execution exec{.threads = 2,
                       .on_progress = [&](const progress&) { return seconds_since(start) < 0.2; }};
  std::atomic<bool> left = false;
  const auto work = [&](std::size_t) {
    if (std::this_thread::get_id() == caller) return work_for(milliseconds(5));
    try {
      parallel_for({}, "inner", 10, [&](std::size_t) {
        while (seconds_since(start) < 20) poll_cancelled();
      });
    } catch (const operation_cancelled&) {
      left = true;
      throw;
    }
  };
  CHECK_THROWS_AS(parallel_for(exec, "outer", 4, work, 1), operation_cancelled);
  CHECK(left);
}

TEST_CASE(
    "poll_cancelled asks the callback of a scope outside of loops, every 50 ms, with what was reported") {
  CHECK_NOTHROW(poll_cancelled());  // nobody to ask
  std::vector<std::string> stages;
  std::vector<double> fractions;
  const execution exec{.on_progress = [&](const progress& p) {
    stages.emplace_back(p.stage);
    fractions.push_back(p.fraction);
    poll_cancelled();  // asks nobody here
    return stages.size() < 4;
  }};
  const auto poll_for = [](double seconds) {
    for (const auto start = clock::now(); seconds_since(start) < seconds;) poll_cancelled();
  };
  const parallel_scope scope(exec, "sorting");
  poll_for(0.07);
  CHECK(stages == std::vector<std::string>{"sorting"});
  report_progress(exec, "pairing", 0.5);
  CHECK_THROWS_AS(poll_for(20), operation_cancelled);
  CHECK(stages == std::vector<std::string>{"sorting", "pairing", "pairing", "pairing"});
  CHECK(fractions == std::vector<double>{0, 0.5, 0.5, 0.5});
}

TEST_CASE("a scope without a callback hears the callback of the one around it, also in its loops") {
  const auto start = clock::now();
  const execution outer{.threads = 2, .on_progress = [&](const progress& p) {
                          return p.stage == "outer" && seconds_since(start) < 0.1;
                        }};
  const parallel_scope scope(outer, "outer");
  const auto work = [&](std::size_t) {
    while (seconds_since(start) < 20) poll_cancelled();
  };
  CHECK_THROWS_AS(parallel_for({.threads = 2}, "inner", 2, work, 1), operation_cancelled);
  CHECK(seconds_since(start) < 10);
}

#ifdef __GLIBC__
TEST_CASE("where the system starts no threads, the work is done by those that there are") {
  pthread_attr_t before, huge;
  REQUIRE(pthread_getattr_default_np(&before) == 0);
  REQUIRE(pthread_attr_init(&huge) == 0);
  REQUIRE(pthread_attr_setstacksize(&huge, std::size_t(1) << 50) == 0);
  const execution exec{.threads = 3};
  const parallel_scope scope(exec, "outer");
  const auto with = threads_of_loop({.threads = 2}, 20);
  REQUIRE(pthread_setattr_default_np(&huge) == 0);
  const auto without = threads_of_loop(exec, 30);
  const auto again = threads_of_loop(exec, 30);
  CHECK_THROWS_AS(std::thread([] {}).join(), std::system_error);  // it is so
  REQUIRE(pthread_setattr_default_np(&before) == 0);
  CHECK(with.size() == 2);
  CHECK(without.size() == 2);
  CHECK(again.size() == 2);
  pthread_attr_destroy(&huge);
  pthread_attr_destroy(&before);
}
#endif

}  // namespace globalmatch::detail::test_threads

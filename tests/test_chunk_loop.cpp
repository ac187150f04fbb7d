#include "globalmatch/detail/core/chunk_loop.hpp"

#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "catch.hpp"

namespace globalmatch::detail::test_chunk_loop {

namespace {

using ranges = std::vector<std::pair<std::size_t, std::size_t>>;

void note(const void* work, std::size_t begin, std::size_t end) {
  (*static_cast<ranges* const*>(work))->push_back({begin, end});
}

/// Fails in the chunks that begin at the indices.
void fail_at(const void* work, std::size_t begin, std::size_t) {
  for (const std::size_t bad : *static_cast<const std::vector<std::size_t>*>(work))
    if (begin == bad) throw std::runtime_error("chunk at " + std::to_string(begin));
}

}  // namespace

TEST_CASE("chunks are taken in order, each once, the last one shorter") {
  ranges seen;
  ranges* const work = &seen;
  chunk_loop loop(10, 4, &work, note);
  CHECK(loop.chunks() == 3);
  CHECK(loop.fraction() == 0);
  std::size_t at = 99;
  for (std::size_t c = 0; c < 3; ++c) {
    CHECK(loop.has_more());
    REQUIRE(loop.take(at));
    CHECK(at == c);
    CHECK(loop.run(at));
    CHECK(loop.fraction() == Approx(double(c + 1) / 3));
  }
  CHECK_FALSE(loop.has_more());
  CHECK_FALSE(loop.take(at));
  CHECK(seen == ranges{{0, 4}, {4, 8}, {8, 10}});
  CHECK_NOTHROW(loop.rethrow());
}

TEST_CASE("a loop over nothing is done, and chunks of nothing are chunks of one") {
  ranges seen;
  ranges* const work = &seen;
  chunk_loop none(0, 5, &work, note);
  std::size_t at = 0;
  CHECK(none.fraction() == 1);
  CHECK_FALSE(none.take(at));
  CHECK(chunk_loop(3, 0, &work, note).chunks() == 3);
}

TEST_CASE("after a failure earlier chunks still run, later ones do not, and the earliest error is kept") {
  const std::vector<std::size_t> bad = {1, 3};
  chunk_loop loop(6, 1, &bad, fail_at);
  std::size_t at[4];
  for (std::size_t& each : at) REQUIRE(loop.take(each));
  CHECK_FALSE(loop.run(at[3]));
  CHECK(loop.is_stopped(4));
  CHECK_FALSE(loop.is_stopped(2));
  CHECK_FALSE(loop.has_more());
  CHECK(loop.run(at[2]));
  CHECK_FALSE(loop.run(at[1]));
  CHECK(loop.is_stopped(2));
  CHECK_FALSE(loop.is_stopped(0));
  CHECK(loop.run(at[0]));
  CHECK_THROWS_WITH(loop.rethrow(), "chunk at 1");
}

TEST_CASE("what the callback threw stops all chunks and goes before their errors") {
  const std::vector<std::size_t> bad = {0};
  chunk_loop loop(4, 1, &bad, fail_at);
  std::size_t at = 9;
  REQUIRE(loop.take(at));
  CHECK_FALSE(loop.run(at));
  loop.interrupt(std::make_exception_ptr(std::logic_error("from the callback")));
  loop.interrupt(std::make_exception_ptr(std::logic_error("a second one")));
  CHECK(loop.is_stopped(0));
  CHECK_FALSE(loop.take(at));
  CHECK_THROWS_WITH(loop.rethrow(), "from the callback");
}

}  // namespace globalmatch::detail::test_chunk_loop

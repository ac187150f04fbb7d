#include "support/announced_blocks.hpp"

#include "catch.hpp"
#include "file_checks.hpp"

namespace globalmatch::support::test_announced_blocks {

namespace {

/// What is said of blocks: a number is a count, a dot a row.
std::string error_of_blocks(const std::string& text, std::optional<std::uint64_t>* announced = nullptr) {
  const temporary_directory directory;
  const input_file file(directory.file("a.pts", "1\n"));
  announced_blocks blocks(file);
  return error_of([&] {
    for (const char c : text) c == '.' ? blocks.add_row() : blocks.begin(std::uint64_t(c - '0'));
    blocks.end();
    if (announced) *announced = blocks.announced();
  });
}

}  // namespace

TEST_CASE("each of several blocks must hold the points that it announces") {
  std::optional<std::uint64_t> announced;
  CHECK(error_of_blocks("2..01.", &announced).empty());
  CHECK(announced == std::uint64_t(3));
  using Catch::Matchers::Contains;
  CHECK_THAT(error_of_blocks("2.1."), Contains("block 1 that announces 2 points but holds 1"));
  CHECK_THAT(error_of_blocks("1.2...0"), Contains("block 2 that announces 2 points but holds 3"));
  CHECK_THAT(error_of_blocks("1.2."), Contains("block 2") && Contains("truncated"));
  CHECK_THAT(error_of_blocks("11"), Contains("block 1 that announces 1 points but holds 0"));
}

TEST_CASE("one block may hold other points than it announces, and rows before a count are no block") {
  std::optional<std::uint64_t> announced;
  CHECK(error_of_blocks("2...").empty());
  CHECK(error_of_blocks("9.").empty());
  CHECK(error_of_blocks("..1.5.2", &announced).empty());
  CHECK(announced == std::uint64_t(8));
  CHECK(error_of_blocks("..", &announced).empty());
  CHECK_FALSE(announced);
}

}  // namespace globalmatch::support::test_announced_blocks

#include "support/wildcards.hpp"

#include <filesystem>
#include <random>
#include <string>

#include "catch.hpp"
#include "file_checks.hpp"

namespace globalmatch::support::test_wildcards {

namespace {

/// The definition, which takes exponential time.
bool matches_by_trying(std::string_view name, std::string_view pattern) {
  if (pattern.empty()) return name.empty();
  if (pattern[0] == '*')
    return matches_by_trying(name, pattern.substr(1)) ||
           (!name.empty() && matches_by_trying(name.substr(1), pattern));
  return !name.empty() && (pattern[0] == '?' || pattern[0] == name[0]) &&
         matches_by_trying(name.substr(1), pattern.substr(1));
}

}  // namespace

TEST_CASE("a name matches a pattern where trying all ways to match it finds one") {
  std::mt19937 random(1);
  const auto word = [&](std::string_view letters) {
    std::string text(random() % 9, ' ');
    for (char& c : text) c = letters[random() % letters.size()];
    return text;
  };
  int matched = 0;
  for (int i = 0; i < 20'000; ++i) {
    const std::string name = word("ab"), pattern = word("ab?**");
    INFO(name << " by " << pattern);
    CHECK(matches(name, pattern) == matches_by_trying(name, pattern));
    matched += matches(name, pattern);
  }
  CHECK(matched > 1000);
}

TEST_CASE("a pattern of many stars takes no longer than its length times that of the name") {
  std::string pattern;
  for (int i = 0; i < 100; ++i) pattern += "*a";
  CHECK_FALSE(matches(std::string(10'000, 'a'), pattern + "*b"));
  CHECK(matches(std::string(10'000, 'a') + 'b', pattern + "*b"));
}

TEST_CASE("patterns may be in the names of folders, and names without wildcards stay as they are") {
  const temporary_directory directory;
  for (const char* folder : {"plot_b", "plot_a", "other"})
    std::filesystem::create_directory(directory / folder);
  directory.file("plot_a/scan.las", "");
  directory.file("plot_b/scan.las", "");
  CHECK(expand_patterns({directory / "plot_?/*.las"}) ==
        std::vector{directory / "plot_a/scan.las", directory / "plot_b/scan.las"});
  CHECK(expand_patterns({directory / "pl*"}) == std::vector{directory / "plot_a", directory / "plot_b"});
  CHECK(expand_patterns({"none", "-", directory / "plot_a"}) ==
        std::vector<std::filesystem::path>{"none", "-", directory / "plot_a"});
}

}  // namespace globalmatch::support::test_wildcards

#include "globalmatch/detail/core/sort_by_key.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_sort_by_key {

using namespace detail;

TEST_CASE("places are sorted by key, equal ones as they came, like those of a stable sort") {
  random_source random(1);
  for (const std::size_t count : {0u, 1u, 2u, 63u, 64u, 65u, 1000u, 5000u})
    for (const int shift : {0, 5, 8, 30, 52, 60}) {  // of the bits in which keys differ
      CAPTURE(count, shift);
      std::vector<keyed_place> entries, spare;
      const std::uint64_t common = std::uint64_t(random.below(1000)) << 3;
      for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint64_t own = std::uint64_t(random.below(1u << 11)) << shift;
        entries.push_back({own + (shift > 20 ? common : 0), i});
      }
      std::vector<keyed_place> expected = entries;
      std::stable_sort(expected.begin(), expected.end(),
                       [](const keyed_place& a, const keyed_place& b) { return a.key < b.key; });
      sort_by_key(entries, spare);
      CHECK(std::equal(
          entries.begin(), entries.end(), expected.begin(), expected.end(),
          [](const keyed_place& a, const keyed_place& b) { return a.key == b.key && a.place == b.place; }));
    }
}

TEST_CASE("keys that differ in their first and last bits only are sorted too") {
  std::vector<keyed_place> entries, spare;
  for (std::uint32_t i = 0; i < 200; ++i) entries.push_back({(std::uint64_t(i % 2) << 63) | (i % 3), i});
  sort_by_key(entries, spare);
  for (std::size_t i = 1; i < entries.size(); ++i) {
    CHECK(entries[i - 1].key <= entries[i].key);
    if (entries[i - 1].key == entries[i].key) CHECK(entries[i - 1].place < entries[i].place);
  }
}

TEST_CASE("the memory of an earlier sort of more does not matter") {
  std::vector<keyed_place> many(300, {9, 9}), few, spare;
  sort_by_key(many, spare);
  for (std::uint32_t i = 0; i < 100; ++i) few.push_back({1000 - 7 * i, i});
  sort_by_key(few, spare);
  REQUIRE(few.size() == 100);
  for (std::uint32_t i = 0; i < 100; ++i) CHECK(few[i].place == 99 - i);
}

TEST_CASE("an order names the places of keys, the smallest first, equal ones as they come") {
  CHECK(order_by({}).empty());
  CHECK(order_by({7}) == std::vector<std::uint32_t>{0});
  CHECK(order_by({5, 2, 5, 1, 2}) == std::vector<std::uint32_t>{3, 1, 4, 0, 2});
  std::vector<std::uint64_t> equal(100, 4);
  std::vector<std::uint32_t> expected(100);
  for (std::uint32_t i = 0; i < 100; ++i) expected[i] = i;
  CHECK(order_by(equal) == expected);
}

}  // namespace globalmatch::test_sort_by_key

#include "globalmatch/detail/core/keyed_sort.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <thread>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_keyed_sort {

using namespace detail;

namespace {

std::vector<keyed> random_items(std::size_t count, std::uint32_t keys, random_source& random) {
  std::vector<keyed> items;
  for (std::size_t i = 0; i < count; ++i) items.push_back({random.below(keys), random.below(1000)});
  return items;
}

bool same(const std::vector<keyed>& a, const std::vector<keyed>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const keyed& x, const keyed& y) { return x.key == y.key && x.value == y.value; });
}

std::vector<keyed> sorted(std::vector<keyed> items) {
  std::sort(items.begin(), items.end(), [](const keyed& a, const keyed& b) {
    return std::pair(a.key, a.value) < std::pair(b.key, b.value);
  });
  return items;
}

}  // namespace

TEST_CASE("keys are in the order of their numbers, of either sign, and lead back to them") {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const std::vector<double> numbers = {-infinity, -1e300, -2.5, -1,  -1e-300, -5e-324, 0.0,
                                       5e-324,    1e-300, 1,    1.5, 1e300,   infinity};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    CHECK(number_of(key_of(numbers[i])) == numbers[i]);
    if (i > 0) CHECK(key_of(numbers[i - 1]) < key_of(numbers[i]));
  }
  random_source random(2);
  for (int i = 0; i < 1000; ++i) {
    const double a = random.normal(), b = random.normal();
    CHECK((key_of(a) < key_of(b)) == (a < b));
    CHECK(number_of(key_of(a)) == a);
  }
}

TEST_CASE("a key of two indices is ordered by the first, then by the second, and holds both") {
  constexpr std::uint32_t most = std::numeric_limits<std::uint32_t>::max();
  CHECK(key_of(1u, most) < key_of(2u, 0u));
  CHECK(key_of(3u, 4u) < key_of(3u, 5u));
  for (const auto& [first, second] : {std::pair(0u, 7u), {7u, 0u}, {most, 1u}, {1u, most}}) {
    CHECK(first_of(key_of(first, second)) == first);
    CHECK(second_of(key_of(first, second)) == second);
  }
}

TEST_CASE("items are sorted by key, then by value, however many there are and however many are equal") {
  random_source random(3);
  for (const std::size_t count : {0u, 1u, 2u, 3u, 1000u, 450'001u})
    for (const std::uint32_t keys : {1u, 5u, 1'000'000u}) {
      std::vector<keyed> items = random_items(count, keys, random);
      const std::vector<keyed> expected = sorted(items);
      sort_keyed(items);
      CHECK(same(items, expected));
    }
}

TEST_CASE("the first items are those of all, sorted, or all where they are fewer") {
  random_source random(4);
  for (const std::size_t count : {0u, 1u, 7u, 200u})
    for (const std::size_t kept : {0u, 1u, 6u, 7u, 8u, 199u, 1000u}) {
      std::vector<keyed> items = random_items(count, 20, random);
      std::vector<keyed> expected = sorted(items);
      expected.resize(std::min(count, kept));
      keep_first(items, kept);
      REQUIRE(items.size() == expected.size());
      CHECK(same(items, expected));
    }
}

TEST_CASE("sorting many items can be cancelled") {
  random_source random(5);
  std::vector<keyed> few = random_items(1000, 100, random), many = random_items(300'000, 100'000, random);
  const execution exec{.on_progress = [](const progress&) { return false; }};
  const parallel_scope scope(exec, "sorting");
  std::this_thread::sleep_for(2 * poll_interval);
  CHECK_NOTHROW(sort_keyed(few));
  CHECK_THROWS_AS(sort_keyed(many), operation_cancelled);
}

}  // namespace globalmatch::test_keyed_sort

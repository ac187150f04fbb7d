#include "globalmatch/detail/core/sort_stably.hpp"

#include <cstdint>
#include <utility>
#include <vector>

#include "catch.hpp"

namespace globalmatch {

namespace {

/// Aligned as nothing is by chance; notes whether it was ever put elsewhere.
struct alignas(4096) wide {
  int key = 0, came = 0;
  bool aligned = true;

  wide(int k, int c) : key(k), came(c) { look(); }
  wide(wide&& other) noexcept : key(other.key), came(other.came), aligned(other.aligned) { look(); }
  wide& operator=(wide&& other) noexcept {
    key = other.key, came = other.came, aligned = aligned && other.aligned;
    return *this;
  }

 private:
  void look() { aligned = aligned && reinterpret_cast<std::uintptr_t>(this) % alignof(wide) == 0; }
};

}  // namespace

TEST_CASE("values are sorted, equal ones keep their order, and none is ever out of alignment") {
  std::vector<wide> values;
  for (int i = 0; i < 200; ++i) values.emplace_back(i * 7919 % 10, i);
  detail::sort_stably(values, [](const wide& a, const wide& b) { return a.key < b.key; });
  REQUIRE(values.size() == 200);
  for (std::size_t i = 0; i < values.size(); ++i) {
    CHECK(values[i].aligned);
    if (i == 0) continue;
    CHECK(std::pair(values[i - 1].key, values[i - 1].came) < std::pair(values[i].key, values[i].came));
  }
}

TEST_CASE("sorting nothing leaves nothing") {
  std::vector<wide> none;
  detail::sort_stably(none, [](const wide& a, const wide& b) { return a.key < b.key; });
  CHECK(none.empty());
}

}  // namespace globalmatch

// The same bits, whatever the threads, the container, the order of the stems: the whole pipeline in one
// number.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

#include "catch.hpp"
#include "containers.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/registration.hpp"

namespace globalmatch::test_determinism {

using namespace detail;

namespace {

/// FNV-1a over the bits of numbers.
class hash {
 public:
  template <class T>
  void add(const T& value) {
    unsigned char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    for (const unsigned char byte : bytes) value_ = (value_ ^ byte) * 1099511628211u;
  }
  void add_matrix(const Eigen::MatrixXd& m) {
    for (Eigen::Index i = 0; i < m.size(); ++i) add(m.data()[i]);
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 14695981039346656037u;
};

std::uint64_t hash_of(const stem_map& map) {
  hash h;
  for (const stem& s : map.stems) {
    h.add_matrix(s.position);
    h.add_matrix(s.axis);
    h.add(s.radius);
    h.add(s.position_sigma);
    for (const point_index i : s.support) h.add(i);
  }
  for (const float z : map.terrain.heights) h.add(z);
  for (const Eigen::Vector3d& p : map.ground_samples) h.add_matrix(p);
  for (const Eigen::Vector3d& p : map.stem_samples) h.add_matrix(p);
  return h.value();
}

/// `order[i]`, `order_of_target[i]`: what stem i of the maps was called before it was moved about.
std::uint64_t hash_of(const registration& r, const std::vector<stem_index>& order = {},
                      const std::vector<stem_index>& order_of_target = {}) {
  const auto name = [](const std::vector<stem_index>& names, stem_index i) {
    return names.empty() ? i : names[i];
  };
  hash h;
  h.add(r.outcome);
  if (r.target_from_source) h.add_matrix(r.target_from_source->matrix());
  h.add(r.matching.probability);
  h.add(r.matching.inlier_threshold);
  if (r.matching.uncertainty) h.add_matrix(r.matching.uncertainty->covariance);
  for (const hypothesis& found : r.matching.hypotheses) {
    h.add_matrix(found.target_from_source.matrix());
    h.add(found.log10_nfa);
    std::vector<correspondence> pairs;
    for (const correspondence& c : found.correspondences)
      pairs.push_back({name(order, c.source), name(order_of_target, c.target)});
    std::sort(pairs.begin(), pairs.end());
    for (const correspondence& c : pairs) {
      h.add(c.source);
      h.add(c.target);
    }
  }
  return h.value();
}

/// Two scans of one plot: the second misses some of the first one's ground.
struct scan_and_most_of_it {
  scenes::cloud source, target;

  scan_and_most_of_it() {
    const scenes::small_plot plot;
    source = plot.scan();
    for (std::size_t i = 0; i < source.size(); ++i)
      if (i % 7 != 0) target.push_back(source[i]);
  }
};

std::vector<stem_index> shuffled(std::size_t count, std::uint64_t seed) {
  std::vector<stem_index> order;
  for (stem_index i = 0; i < count; ++i) order.push_back(i);
  random_source random(seed);
  for (std::size_t i = count; i > 1; --i)
    std::swap(order[i - 1], order[random.below(static_cast<std::uint32_t>(i))]);
  return order;
}

stem_map reordered(stem_map map, const std::vector<stem_index>& order) {
  std::vector<stem> stems;
  for (const stem_index i : order) stems.push_back(map.stems[i]);
  map.stems = std::move(stems);
  return map;
}

}  // namespace

TEST_CASE("the pipeline gives the same bits for 1, 2 and 8 threads, and for each again") {
  const scan_and_most_of_it scans;
  const auto run = [&](int threads) {
    const auto result =
        register_scans(scans.source, scans.target, {}, Eigen::Vector3d::UnitZ(), {.threads = threads});
    CHECK(result.registration.outcome == outcome::registered);
    return std::array{hash_of(result.source), hash_of(result.target), hash_of(result.registration)};
  };
  const auto alone = run(1);
  CHECK(alone[0] != alone[1]);
  for (const int threads : {1, 2, 8}) CHECK(run(threads) == alone);
}

TEST_CASE("registering gives the same bits for stems in any order") {
  const scan_and_most_of_it scans;
  const stem_map source = map_stems(scans.source), target = map_stems(scans.target);
  const std::uint64_t as_mapped = hash_of(register_maps(source, target));
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const auto order = shuffled(source.stems.size(), seed), other = shuffled(target.stems.size(), seed + 10);
    CHECK(hash_of(register_maps(reordered(source, order), reordered(target, other)), order, other) ==
          as_mapped);
  }
}

TEST_CASE("one scan in any container is registered with the same bits") {
  const scan_and_most_of_it scans;
  const stem_map target = map_stems(scans.target);
  const std::uint64_t expected = hash_of(register_maps(map_stems(scans.source), target));
  containers::for_each_container(scans.source, [&](const std::string& kind, const auto& range) {
    CAPTURE(kind);
    CHECK(hash_of(register_maps(map_stems(range), target)) == expected);
  });
}

TEST_CASE(
    "a scan moved by (500000, 5300000, 1000) has its stems and transform shifted by that to a micrometre") {
  const scan_and_most_of_it scans;
  const Eigen::Vector3d shift(500000, 5300000, 1000);
  std::vector<Eigen::Vector3d> moved;
  for (const Eigen::Vector3f& p : scans.source) moved.push_back(p.cast<double>() + shift);
  const stem_map here = map_stems(scans.source), there = map_stems(moved), target = map_stems(scans.target);
  REQUIRE(there.stems.size() == here.stems.size());
  for (std::size_t i = 0; i < here.stems.size(); ++i)
    CHECK((there.stems[i].position - shift - here.stems[i].position).norm() < 1e-6);
  const auto from_here = register_maps(here, target).target_from_source;
  const auto from_there = register_maps(there, target).target_from_source;
  REQUIRE((from_here && from_there));
  for (const stem& s : here.stems)
    CHECK((*from_there * (s.position + shift) - *from_here * s.position).norm() < 1e-6);
}

}  // namespace globalmatch::test_determinism

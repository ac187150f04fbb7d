#include "globalmatch/detail/core/neighbors.hpp"

#include <Eigen/Core>
#include <thread>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "oracles/brute_force_neighbors.hpp"

namespace globalmatch::test_neighbors {

using namespace detail;

namespace {

template <class T, int Dimension>
using point_of = std::array<T, std::size_t(Dimension)>;

template <class T, int Dimension>
neighbor_tree<T, Dimension> tree_of(const std::vector<point_of<T, Dimension>>& points) {
  return {points.size(),
          [&](std::size_t i) { return Eigen::Map<const Eigen::Matrix<T, Dimension, 1>>(points[i].data()); }};
}

template <class T>
bool equal(const std::vector<neighbor<T>>& a, const std::vector<neighbor<T>>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& m, const auto& n) {
    return m.index == n.index && m.squared_distance == n.squared_distance;
  });
}

template <class T, int Dimension>
std::vector<neighbor<T>> within(const neighbor_tree<T, Dimension>& tree, const point_of<T, Dimension>& query,
                                T radius) {
  std::vector<neighbor<T>> found;
  tree.for_each_within(query, radius, [&](std::uint32_t i, T d) { found.push_back({i, d}); });
  std::sort(found.begin(), found.end());
  return found;
}

/// How many of the queries a tree answers otherwise than the oracle.
template <class T, int Dimension>
int disagreements(const std::vector<point_of<T, Dimension>>& points,
                  const std::vector<point_of<T, Dimension>>& queries) {
  const auto tree = tree_of<T, Dimension>(points);
  std::vector<neighbor<T>> found;
  int count = 0;
  for (const auto& query : queries) {
    for (const std::size_t k : {1u, 2u, 7u, 20u, 1000u}) {
      tree.nearest(query, k, found);
      count += equal(found, oracles::brute_force_nearest(points, query, k)) ? 0 : 1;
    }
    for (const T radius : {T(0.5), T(1), T(2), T(5)})
      count += equal(within(tree, query, radius), oracles::brute_force_within(points, query, radius)) ? 0 : 1;
  }
  return count;
}

/// Points on the lattice of whole metres, each also a second time, at random places in the list.
template <class T, int Dimension>
std::vector<point_of<T, Dimension>> shuffled_lattice(std::uint64_t seed, std::uint32_t side) {
  random_source random(seed);
  std::vector<point_of<T, Dimension>> points(250);
  for (auto& p : points)
    for (T& coordinate : p) coordinate = T(random.below(side));
  points.insert(points.end(), points.begin(), points.begin() + 60);
  return points;
}

template <class T, int Dimension>
std::vector<point_of<T, Dimension>> random_points(std::uint64_t seed, std::size_t count, double offset) {
  random_source random(seed);
  std::vector<point_of<T, Dimension>> points(count);
  for (auto& p : points)
    for (T& coordinate : p) coordinate = T(offset + 10 * random.uniform());
  return points;
}

}  // namespace

TEST_CASE("neighbours are ordered by distance, then by index") {
  const neighbor<float> near{7, 1}, far{2, 4}, near_but_later{8, 1};
  CHECK(near < far);
  CHECK(near < near_but_later);
  CHECK_FALSE(near_but_later < near);
  CHECK_FALSE(near < near);
}

TEST_CASE("neighbours on integer lattices full of ties equal brute force") {
  CHECK(disagreements<float, 2>(shuffled_lattice<float, 2>(1, 15), shuffled_lattice<float, 2>(2, 17)) == 0);
  CHECK(disagreements<float, 3>(shuffled_lattice<float, 3>(3, 6), shuffled_lattice<float, 3>(4, 8)) == 0);
  CHECK(disagreements<double, 2>(shuffled_lattice<double, 2>(5, 15), shuffled_lattice<double, 2>(6, 17)) ==
        0);
  CHECK(disagreements<double, 3>(shuffled_lattice<double, 3>(7, 6), shuffled_lattice<double, 3>(8, 8)) == 0);
}

TEST_CASE("neighbours of random points equal brute force, near the origin and far from it") {
  CHECK(disagreements<float, 3>(random_points<float, 3>(1, 500, 0), random_points<float, 3>(2, 100, 0)) == 0);
  CHECK(disagreements<float, 3>(random_points<float, 3>(3, 500, 1000),
                                random_points<float, 3>(4, 100, 1000)) == 0);
  CHECK(disagreements<double, 2>(random_points<double, 2>(5, 500, 5e6),
                                 random_points<double, 2>(6, 100, 5e6)) == 0);
}

TEST_CASE("the radius is exclusive") {
  const auto tree = tree_of<double, 2>({{0, 0}, {3, 4}, {0, 1}});
  CHECK(within<double, 2>(tree, {0, 0}, 5).size() == 2);
  CHECK(within<double, 2>(tree, {0, 0}, std::nextafter(5.0, 6.0)).size() == 3);
  CHECK(within<double, 2>(tree, {0, 0}, 1).size() == 1);
  CHECK(within<double, 2>(tree, {0, 0}, 0).empty());
}

TEST_CASE("of equal points the ones with the lowest indices are the nearest") {
  const auto tree = tree_of<float, 3>(std::vector<point_of<float, 3>>(500, {1, 2, 3}));
  std::vector<neighbor<float>> found;
  tree.nearest({1, 2, 3}, 40, found);
  REQUIRE(found.size() == 40);
  for (std::uint32_t i = 0; i < 40; ++i) CHECK(found[i].index == i);
  CHECK(within<float, 3>(tree, {1, 2, 3}, 0.1f).size() == 500);
}

TEST_CASE("collinear points and an outlier have the neighbours of brute force") {
  std::vector<point_of<float, 3>> points;
  for (int i = 0; i < 300; ++i) points.push_back({0, 0, float(i % 100)});
  points.push_back({1e9f, -1e9f, 1e9f});
  CHECK(disagreements<float, 3>(points, points) == 0);
}

TEST_CASE("a tree without points finds none") {
  const auto tree = tree_of<float, 3>({});
  std::vector<neighbor<float>> found(3);
  tree.nearest({0, 0, 0}, 5, found);
  CHECK(found.empty());
  CHECK(within<float, 3>(tree, {0, 0, 0}, 1e9f).empty());
  CHECK(tree.size() == 0);
}

TEST_CASE("fewer than k points are all found, and none for k = 0") {
  const auto tree = tree_of<float, 3>({{0, 0, 1}, {0, 0, 0}});
  std::vector<neighbor<float>> found;
  tree.nearest({0, 0, 0}, 5, found);
  REQUIRE(found.size() == 2);
  CHECK(found[0].index == 1);
  CHECK(found[1].squared_distance == 1);
  tree.nearest({0, 0, 0}, 0, found);
  CHECK(found.empty());
}

TEST_CASE("a tree owns its points and may be moved") {
  auto points = random_points<float, 3>(1, 200, 0);
  auto first = tree_of<float, 3>(points);
  const auto kept = points;
  for (auto& p : points) p = {0, 0, 0};
  const auto tree = std::move(first);
  std::vector<neighbor<float>> found;
  tree.nearest(kept[5], 10, found);
  CHECK(equal(found, oracles::brute_force_nearest(kept, kept[5], 10)));
  CHECK(tree[7] == kept[7]);
}

TEST_CASE("points are visited in the same order by every tree of them") {
  const auto points = shuffled_lattice<float, 3>(9, 6);
  const auto visits = [&] {
    const auto tree = tree_of<float, 3>(points);
    std::vector<std::uint32_t> order;
    tree.for_each_within({2, 2, 2}, 3, [&](std::uint32_t i, float) { order.push_back(i); });
    return order;
  };
  CHECK(visits() == visits());
}

TEST_CASE("several threads may query one tree") {
  const auto points = shuffled_lattice<float, 2>(10, 15);
  const auto tree = tree_of<float, 2>(points);
  std::array<int, 4> wrong = {};
  std::vector<std::thread> threads;
  for (int& mine : wrong)
    threads.emplace_back([&] {
      std::vector<neighbor<float>> found;
      for (const auto& query : points) {
        tree.nearest(query, 9, found);
        mine += equal(found, oracles::brute_force_nearest(points, query, 9)) ? 0 : 1;
      }
    });
  for (std::thread& t : threads) t.join();
  CHECK(wrong == std::array<int, 4>{});
}

}  // namespace globalmatch::test_neighbors

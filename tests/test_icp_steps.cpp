#include "globalmatch/detail/icp/icp_steps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_icp_steps {

using namespace detail;

using scenes::positions;

namespace {

using scenes::four;
using scenes::six;

icp_surface surface_of(const positions& source, const positions& target, const icp_options& options) {
  icp_samples samples;
  for (const Eigen::Vector3d& p : source) samples.source.push_back(from_eigen(p));
  for (const Eigen::Vector3d& p : target) samples.target.push_back(from_eigen(p));
  return icp_surface(std::move(samples), {0, 0, 0}, options);
}

positions grid_of_samples(double height, double step) {
  positions samples;
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 15; ++j) samples.push_back({0.1 * i, 0.2 * j, height + step * ((3 * i + 7 * j) % 5)});
  return samples;
}

}  // namespace

TEST_CASE("how far the pairs of a layer lie off their planes does not change the weights of another") {
  const icp_options options{.metric = icp_metric::point_to_plane};
  icp_surface rough = surface_of(grid_of_samples(0, 0.03), grid_of_samples(0, 0), options),
              smooth = surface_of(grid_of_samples(5, 0.001), grid_of_samples(5, 0), options);
  for (const auto& layers : {std::array{&rough, &smooth}, std::array{&smooth, &rough}}) {
    std::vector<icp_pair> together, apart;
    for (icp_surface* layer : layers) {
      std::vector<icp_pair> own;
      pair_nearest(*layer, rigid::identity(), {0, 0, 0}, options, {}, together);
      pair_nearest(*layer, rigid::identity(), {0, 0, 0}, options, {}, own);
      apart.insert(apart.end(), own.begin(), own.end());
    }
    REQUIRE(together.size() == apart.size());
    for (std::size_t i = 0; i < apart.size(); ++i) CHECK(together[i].weight == apart[i].weight);
  }
}

TEST_CASE("pairs further apart than so many medians of their layer are dropped") {
  icp_options options{.metric = icp_metric::point_to_point};
  options.trimming = 4;
  positions target = grid_of_samples(0, 0), source = target;
  for (std::size_t i = 0; i < source.size(); ++i)
    source[i].z() += i % 10 == 0 ? 0.25 : i % 10 == 1 ? 0.078 : i % 10 == 2 ? 0.082 : 0.02;
  std::vector<icp_pair> pairs;
  icp_surface surface = surface_of(source, target, options);
  pair_nearest(surface, rigid::identity(), {0, 0, 0}, options, {}, pairs);
  CHECK(pairs.size() == source.size() * 8 / 10);
  options.max_distance = 0.05;
  pairs.clear();
  pair_nearest(surface, rigid::identity(), {0, 0, 0}, options, {}, pairs);
  CHECK(pairs.size() == source.size() * 7 / 10);
}

TEST_CASE("one step by planes undoes a small transform but for its square, wherever the samples lie") {
  random_source random(62);
  constexpr double small = 1e-4;
  const rigid free_transform = shifted_after({rotation_about(vec3{1, -2, 4}.normalized(), small), {}},
                                             {0.3 * small, -small, 0.5 * small});
  for (const auto dof : {four, six}) {
    const rigid off =
        dof == six ? free_transform : rigid{rotation_about_z(small), {0.3 * small, -small, 0.5 * small}};
    std::vector<icp_pair> pairs;
    vec3 center;
    for (int i = 0; i < 60; ++i) {
      const vec3 target{scenes::uniform(random, 20, 28), scenes::uniform(random, -9, 3),
                        5 * random.uniform()};
      const vec3 normal = vec3{random.normal(), random.normal(), random.normal()}.normalized();
      pairs.push_back({off * target, target, normal, 0.2 + random.uniform()});
      center += pairs.back().transformed / 60.0;
    }
    const auto step = plane_step(pairs, center, dof);
    REQUIRE(step);
    for (const icp_pair& pair : pairs)
      CHECK((*step * pair.transformed - pair.target).norm() < 100 * small * small);
  }
}

TEST_CASE("the rms by planes is that of the distances along the normals, weighted by Tukey's weights") {
  const positions target = grid_of_samples(0, 0);
  positions source = target;
  double off[4] = {0.01, -0.01, 0.03, -0.03};  // in blocks of four that have neither shift nor slope
  for (std::size_t i = 0; i < source.size(); ++i) source[i].z() += off[(i % 15 * 2 + i / 15) % 4];
  icp_options options{.metric = icp_metric::point_to_plane};
  options.max_iterations = 1;
  icp_samples samples;
  for (const Eigen::Vector3d& p : source) samples.source.push_back(from_eigen(p));
  for (const Eigen::Vector3d& p : target) samples.target.push_back(from_eigen(p));
  const icp_result result = refine_layers({samples}, rigid::identity(), four, options, {});
  std::vector<double> sizes;
  for (std::size_t i = 0; i < source.size(); ++i) sizes.push_back(std::abs(source[i].z()));
  std::sort(sizes.begin(), sizes.end());
  const double limit = 4.685 * 1.4826 * (sizes[149] + sizes[150]) / 2;
  double squares = 0, weights = 0;
  for (const double size : sizes) {
    const double share = size / limit, weight = share < 1 ? std::pow(1 - share * share, 2) : 0;
    squares += weight * size * size;
    weights += weight;
  }
  CHECK(result.rms == Approx(std::sqrt(squares / weights)).epsilon(1e-9));
}

TEST_CASE("the normal at a target sample is that of the plane around it, wherever that lies") {
  const vec3 normal = vec3{0.3, -0.5, 1}.normalized();
  positions target;
  for (const Eigen::Vector3d& p : grid_of_samples(0, 0))
    target.push_back({40 + p.x(), -30 + p.y(), 7 - (normal.x * p.x() + normal.y * p.y()) / normal.z});
  const icp_options options{.metric = icp_metric::point_to_plane};
  icp_surface surface = surface_of(target, target, options);
  std::vector<icp_pair> pairs;
  pair_nearest(surface, rigid::identity(), {0, 0, 0}, options, {}, pairs);
  REQUIRE(surface.normals.size() == target.size());
  for (const vec3& n : surface.normals) CHECK(std::abs(n.dot(normal)) == Approx(1));
}

}  // namespace globalmatch::test_icp_steps

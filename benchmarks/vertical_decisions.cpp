// Windows of 30 m around two places of a real stem map, as mobile lidar sees them: noise, false stems,
// terrain, and heights that drift or a scan that is rotated. Are they registered, and is distinguished which
// it is?
#include <globalmatch/stem_matching.hpp>

#include <Eigen/Dense>

#include "normalised_errors.hpp"
#include "stem_layouts.hpp"
#include "support/atomic_file.hpp"
#include "support/programs/command_line.hpp"
#include "support/stem_files.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <numbers>
#include <string>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::detail;
using namespace globalmatch::benchmarks;

namespace {

enum class ground_form { planar, rolling, rough };
constexpr const char* name_of(ground_form r) {
  return r == ground_form::planar ? "planar" : r == ground_form::rolling ? "rolling" : "rough";
}

/// Terrain [m]: a slope of 5 degrees; waves of 1.5 m; on these a noise of 0.3 m.
double height_of(ground_form r, double x, double y, random_source& random) {
  const double slope = std::tan(5 * std::numbers::pi / 180) * x;
  if (r == ground_form::planar) return slope;
  const double waves = 1.5 * std::sin(x / 8) * std::cos(y / 11);
  return r == ground_form::rolling ? slope + waves : slope + waves + 0.3 * gaussian(random, 1).z();
}

struct pair_of_windows {
  two_maps maps;
  two_maps common;  // stems that both see
  double tilt = 0;  // [rad] of the drift, or of the rotation
  bool rotated = false;
  Eigen::Isometry3d levelled;  // turns the source back, or as its heights would have it
};

/// Squared distances [m^2] in plan that the best transform in plan leaves.
double squares_in_plan(const positions& source, const positions& target) {
  const auto count = Eigen::Index(source.size());
  Eigen::Matrix2Xd from(2, count), to(2, count);
  for (std::size_t i = 0; i < source.size(); ++i) {
    from.col(Eigen::Index(i)) = source[i].head<2>();
    to.col(Eigen::Index(i)) = target[i].head<2>();
  }
  const Eigen::Matrix3d transform = Eigen::umeyama(from, to, false);
  return ((transform.topLeftCorner<2, 2>() * from).colwise() + transform.topRightCorner<2, 1>() - to)
      .squaredNorm();
}

/// Whether the more likely one of drift and rotation is so: for who knows which stems belong together and by
/// how much it would be rotated, there is nothing better.
bool is_distinguishable(const pair_of_windows& pair) {
  positions levelled;
  for (const Eigen::Vector3d& p : pair.common.source) levelled.push_back(pair.levelled * p);
  const bool is_rotated =
      squares_in_plan(levelled, pair.common.target) < squares_in_plan(pair.common.source, pair.common.target);
  return is_rotated == pair.rotated;
}

/// Two windows up to 30 m apart; the heights of the source drift by up to 8 degrees, or it is rotated by as
/// much about a horizontal axis.
pair_of_windows cut_pair(const positions& map, ground_form ground, random_source& random) {
  constexpr double radius = 30, max_tilt = 8 * std::numbers::pi / 180, false_share = 0.3;
  pair_of_windows pair;
  const double noise = uniform(random, 0.05, 0.1);
  const Eigen::Vector3d first = map[random.below(static_cast<std::uint32_t>(map.size()))];
  const double direction = uniform(random, 0, 2 * std::numbers::pi), apart = uniform(random, 5, 30);
  const Eigen::Vector3d second = first + apart * Eigen::Vector3d(std::cos(direction), std::sin(direction), 0);
  const auto see = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& from, double reach,
                       positions& stems) {
    if ((p - from).head<2>().norm() >= reach) return false;
    stems.push_back(p - first + gaussian(random, noise));
    return true;
  };
  for (Eigen::Vector3d tree : map) {
    tree.z() = first.z() + height_of(ground, tree.x(), tree.y(), random);
    const bool in_source = see(tree, first, radius, pair.maps.source);
    if (!see(tree, second, radius, pair.maps.target) || !in_source) continue;
    pair.common.source.push_back(pair.maps.source.back());
    pair.common.target.push_back(pair.maps.target.back());
  }
  for (const auto& [stems, center] : {std::pair(&pair.maps.source, Eigen::Vector3d(0, 0, 0)),
                                      std::pair(&pair.maps.target, Eigen::Vector3d(second - first))})
    for (auto i = std::size_t(false_share * double(stems->size())); i > 0; --i) {
      const double d = radius * std::sqrt(random.uniform()), a = uniform(random, 0, 2 * std::numbers::pi);
      const double x = center.x() + d * std::cos(a), y = center.y() + d * std::sin(a);
      stems->push_back({x, y, height_of(ground, x + first.x(), y + first.y(), random)});
    }
  pair.rotated = random.uniform() < 0.5;
  pair.tilt = uniform(random, 0, max_tilt);
  Eigen::Isometry3d moved = Eigen::Isometry3d::Identity();
  if (pair.rotated)
    moved =
        Eigen::AngleAxisd(pair.tilt, Eigen::AngleAxisd(uniform(random, 0, 6.3), Eigen::Vector3d::UnitZ()) *
                                         Eigen::Vector3d::UnitX());
  pair.levelled = pair.rotated ? Eigen::Isometry3d(moved.inverse())
                               : Eigen::Isometry3d(Eigen::AngleAxisd(pair.tilt, Eigen::Vector3d::UnitY()));
  for (positions* stems : {&pair.maps.source, &pair.common.source})
    for (Eigen::Vector3d& p : *stems) {
      if (!pair.rotated) p.z() += std::tan(pair.tilt) * p.x();
      p = moved * p;
    }
  pair.maps.target_from_source =
      Eigen::Translation3d(uniform(random, -100, 100), uniform(random, -100, 100), 5) *
      Eigen::AngleAxisd(uniform(random, -std::numbers::pi, std::numbers::pi), Eigen::Vector3d::UnitZ());
  for (Eigen::Vector3d& p : pair.maps.target) p = pair.maps.target_from_source * p;
  pair.maps.target_from_source = pair.maps.target_from_source * moved.inverse();
  return pair;
}

struct tally {
  std::size_t pairs = 0, right = 0, wrong = 0, distinguished = 0, distinguishable = 0, clear = 0;
  normalised_errors errors;
};

/// Where stems end in plan, on average [m].
double error_in_plan(const Eigen::Isometry3d& transform, const two_maps& maps) {
  double sum = 0;
  for (const Eigen::Vector3d& p : maps.source)
    sum += (transform * p - maps.target_from_source * p).head<2>().norm() / double(maps.source.size());
  return sum;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Registers windows of a stem map whose heights drift, or of which one is rotated.",
               "vertical_decisions");
  std::filesystem::path map_file;
  std::size_t pairs = 500;
  std::uint64_t seed = 1;
  support::shared_options shared;
  app.add_option("MAP", map_file, "CSV of stems")->required();
  app.add_option("--pairs", pairs, "windows of each terrain")->capture_default_str();
  app.add_option("--seed", seed, "of the windows")->capture_default_str();
  shared.add_matching_to(app);
  shared.add_threads_to(app);
  return support::run_program(app, argc, argv, [&] {
    constexpr std::size_t min_common = 12;
    constexpr double clear_tilt = 1 * std::numbers::pi / 180, right_within = 0.3;  // [rad], [m]
    positions map;
    for (const auto& s : support::read_stems(map_file).stems) map.push_back({s.x, s.y, s.z});
    std::cout << "| terrain | pairs of 12 common stems | registered and right | wrong | drift and rotation "
                 "of more than a degree "
                 "distinguished | at best | normalised errors in plan | in height "
                 "|\n|---|---|---|---|---|---|---|---|\n";
    for (const ground_form ground : {ground_form::planar, ground_form::rolling, ground_form::rough}) {
      random_source random(seed + std::uint64_t(ground) * 1000);
      tally all;
      while (all.pairs < pairs) {
        const pair_of_windows pair = cut_pair(map, ground, random);
        if (pair.common.source.size() < min_common) continue;
        const matching result = match_stems(pair.maps.source, pair.maps.target, shared.for_matching(),
                                            Eigen::Vector3d::UnitZ(), {.threads = shared.threads});
        ++all.pairs;
        if (!result.target_from_source) continue;
        const bool right = error_in_plan(*result.target_from_source, pair.maps) < right_within;
        ++(right ? all.right : all.wrong);
        if (!right) continue;
        // That of heights that drift has no truth.
        if (result.uncertainty)
          all.errors.add(*result.target_from_source, pair.maps.target_from_source, *result.uncertainty,
                         pair.rotated && result.vertical->is_known());
        if (pair.tilt < clear_tilt) continue;
        ++all.clear;
        all.distinguishable += is_distinguishable(pair);
        all.distinguished +=
            result.vertical->kind == (pair.rotated ? vertical_kind::rotated : vertical_kind::sloping);
      }
      const auto share = [&](std::size_t count) {
        return 100 * double(count) / double(std::max<std::size_t>(1, all.clear));
      };
      std::cout << std::fixed << std::setprecision(1) << "| " << name_of(ground) << " | " << all.pairs
                << " | " << 100 * double(all.right) / double(all.pairs) << " % | " << all.wrong << " | "
                << share(all.distinguished) << " % of " << all.clear << " | " << share(all.distinguishable)
                << " % | " << all.errors << " |\n"
                << std::flush;
    }
    return support::done;
  });
}

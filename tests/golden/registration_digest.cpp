// Digests of the stem maps of simulated and of real scans, and of what registers them.
#include <globalmatch/registration.hpp>

#include "digest.hpp"
#include "support/scan_files.hpp"
#include "support/simulator/scenes.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <filesystem>
#include <iostream>
#include <string>

namespace globalmatch::golden {

static digests digest_of(const stem_map& map) {
  digests d;
  for (const stem& s : map.stems) {
    d.outcome.add(s.position);
    d.everything.add(s.position);
    d.everything.add(s.axis);
    for (const double number :
         {s.radius, s.radius_sigma, s.taper, s.position_sigma, s.height_sigma, s.quality})
      d.everything.add(number);
    d.everything.add(std::uint64_t(s.ground_seen));
    for (const point_index i : s.support) d.everything.add(std::uint64_t(i));
  }
  d.everything.add(map.up);
  for (const float height : map.terrain.heights) d.everything.add(double(height));
  for (const auto* samples : {&map.ground_samples, &map.stem_samples, &map.stem_normals})
    for (const Eigen::Vector3d& p : *samples) d.everything.add(p);
  for (const double number : {map.spacing_near, map.spacing_far, map.distance_tolerance})
    d.everything.add(number);
  return d;
}

static digests digest_of(const registration& r) {
  digests d = digest_of(r.matching);
  const Eigen::Isometry3d transform = r.target_from_source.value_or(Eigen::Isometry3d::Identity());
  d.outcome.add(transform);
  d.everything.add(transform);
  return d;
}

namespace {

template <class Points>
void print_scans(const std::string& name, const Points& source, const Points& target) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const auto map = [&](const Points& scan) {
    return [&](const execution& exec) { return digest_of(map_stems(scan, {}, up, exec)); };
  };
  print(name + "/source", map(source));
  print(name + "/target", map(target));
  const stem_map from = map_stems(source), onto = map_stems(target);
  print(name + "/registration",
        [&](const execution& exec) { return digest_of(register_maps(from, onto, {}, exec)); });
  registration_options six;
  six.matching.dof = degrees_of_freedom::six;
  print(name + "/registration_6dof",
        [&](const execution& exec) { return digest_of(register_maps(from, onto, six, exec)); });
}

void print_scenes() {
  for (const char* name : {"plot_1", "plot_3", "sparse_natural", "slope_15", "tilt_8", "mobile"}) {
    support::simulation_options options = support::find_scene(name).options;
    options.scanner.angular_step = 0.2;
    support::simulation scene(options);
    const auto first = scene.scan(0), second = scene.scan(1);
    print_scans(std::string("scenes/") + name, second.points, first.points);
  }
}

void print_clouds(const std::filesystem::path& clouds) {
  for (const char* name :
       {"pine_plot_interleaved", "pine_plot_virtualscans", "dense_conifers_virtualscans"}) {
    const auto source = support::open_scan(clouds / (std::string(name) + "_src.ply"));
    const auto target = support::open_scan(clouds / (std::string(name) + "_tgt.ply"));
    print_scans(std::string("clouds/") + name, source, target);
    if (name != std::string("pine_plot_interleaved")) continue;
    print(std::string("clouds/") + name + "/published", [&](const execution& exec) {
      return digest_of(
          register_scans(source, target, paper_options(), Eigen::Vector3d::UnitZ(), exec).registration);
    });
  }
}

}  // namespace
}  // namespace globalmatch::golden

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: registration_digest CLOUDS      folder of the real scans\n";
    return 2;
  }
  globalmatch::golden::print_scenes();
  globalmatch::golden::print_clouds(argv[1]);
  return globalmatch::golden::threads_agree ? 0 : 1;
}

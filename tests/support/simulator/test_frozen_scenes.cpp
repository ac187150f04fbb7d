// Results are reported on the frozen scenes: whoever changes one by accident shall know.
//
// Checksums would differ with the last bits, which compilers and processors do not share. Counts and means
// move with every option and with the order in which random numbers are drawn, but hardly with last bits.
#include "support/simulator/scenes.hpp"

#include "catch.hpp"

#include <array>
#include <vector>

namespace globalmatch::support::test_frozen_scenes {
namespace {

using Eigen::Vector3d;
using Eigen::Vector4d;

Vector4d place_and_size(const Vector3d& p) {
  return {p.x(), p.y(), p.z(), 0};
}

/// Of a stem's skin. The mean of a ring is its axis: only squares tell how thick it is.
Vector4d place_and_size(const Eigen::Vector3f& p) {
  const Vector3d vertex = p.cast<double>();
  return {vertex.x(), vertex.y(), vertex.z(), 0.01 * vertex.squaredNorm()};
}

Vector4d place_and_size(const Eigen::Vector4f& place_and_radius) {
  return place_and_radius.cast<double>();
}

Vector4d place_and_size(const stem& s) {
  const Vector3d middle = s.axis_at(0.5 * s.height);
  return {middle.x(), middle.y(), middle.z(), s.dbh};
}

Vector4d place_and_size(const station& s) {
  return place_and_size(Vector3d(s.plot_from_scan * Vector3d(1, 2, 3)));  // moves with its attitude, too
}

/// A mean of all coordinates, with weights so that none makes up for another.
template <class Thing>
double fingerprint(const std::vector<Thing>& things) {
  double sum = 0;
  for (const Thing& thing : things) sum += Vector4d(1, 2, 3, 50).dot(place_and_size(thing));
  return sum / double(things.size());
}

/// But for last bits.
Approx same(double value) {
  return Approx(value).epsilon(0).margin(1e-5);
}

/// Coarse, and cut out of the middle: quick, but with all that the scene is made of.
simulation_options small_cut(const char* scene) {
  simulation_options o = find_scene(scene).options;
  o.plot.width = o.plot.depth = 16;
  o.plot.margin = 2;
  o.stations.count = 2;
  o.stations.distance = 5;
  o.scanner.angular_step = 1;
  o.way.rays_per_place = 200;
  return o;
}

}  // namespace

TEST_CASE("the frozen scenes have the stems, stations and surfaces that they had when they were frozen") {
  struct frozen {
    const char* scene;
    std::size_t stem_count;
    double stems, stations;
    std::size_t surface_count;  // of the small cut, harvested
    double skins, curves, discs;
  };
  const std::vector<frozen> all = {
      {"plot_a_like", 212, 35.6130885, 13.7775302, 106449, 57.4812369, 22.6901913, 28.7422651},
      {"plot_1", 627, 40.7246375, 15.1088906, 230838, 77.5281561, 2.1139230, 43.9635213},
      {"plot_2", 934, 48.7365852, 16.4190905, 225108, 105.3766436, 29.2092323, 38.0365411},
      {"plot_3", 259, 13.5530858, 13.3043885, 46470, 37.2171581, 7.9030592, 12.0852296},
      {"plot_4", 613, 18.9846783, 15.7011183, 130074, 48.0967859, 14.0590652, 19.4888594},
      {"sparse_natural", 155, 41.3236779, 14.0117945, 36234, 79.2237385, 26.7227276, 38.3416319},
      {"underwood", 302, 37.4315582, 15.8227184, 149428, 58.3149208, 12.5798940, 12.3077004},
      {"slope_15", 302, 38.0493849, 15.8546645, 80347, 56.7751399, 21.1750510, 30.3482041},
      {"slope_28", 302, 38.6708871, 15.8861112, 80347, 57.0285422, 20.0087864, 29.2040839},
      {"lean_12", 302, 37.2873535, 15.8227184, 80347, 61.2239854, 21.9693340, 31.0344503},
      {"tilt_3", 302, 37.4315582, 15.9336908, 80347, 58.3149208, 22.4004629, 31.5599375},
      {"tilt_8", 302, 37.4315582, 16.0584974, 80347, 58.3149208, 22.4004629, 31.5599375},
      {"far_30", 410, 39.1669207, 13.5040356, 55285, 60.0216443, 20.1515508, 29.5562778},
      {"harvest_40", 302, 37.4315582, 15.8227184, 48447, 59.7066117, 14.2972839, 25.6844512},
      {"mobile", 302, 37.4315582, -0.8719147, 80212, 58.3149208, 22.6527631, 31.7048273},
      {"sparse_far", 258, 40.5185112, 13.4173160, 16015, 57.0863710, 17.7896937, 27.5003965},
      {"far_slope", 792, 39.4898847, 13.7502700, 55285, 57.4080836, 18.9630580, 28.3674186},
      {"thicket", 738, 37.3023329, 13.6087869, 173330, 58.5712393, 15.7662387, 19.1734715}};
  CHECK(all.size() == frozen_scenes().size());
  for (const frozen& known : all) {
    INFO(known.scene);
    const simulation whole(find_scene(known.scene).options), cut(small_cut(known.scene));
    CHECK(whole.plot().stems.size() == known.stem_count);
    CHECK(fingerprint(whole.plot().stems) == same(known.stems));
    CHECK(fingerprint(whole.stations()) == same(known.stations));

    std::vector<Eigen::Vector2d> clearings;
    for (const station& s : cut.stations()) clearings.push_back(s.plot_from_scan.translation().head<2>());
    const surfaces now = surfaces_of(cut.plot(), clearings, true);
    CHECK(now.stems.vertices.size() + now.curve_points.size() + now.discs.size() == known.surface_count);
    CHECK(fingerprint(now.stems.vertices) == same(known.skins));
    CHECK(fingerprint(now.curve_points) == same(known.curves));
    CHECK(fingerprint(now.discs) == same(known.discs));
  }
}

TEST_CASE("scans of frozen scenes, cut small, are what they were when they were frozen") {
  struct frozen {
    const char* scene;
    std::size_t count;
    double points;
    std::array<double, 4> ranges;  // [m] of the first points: they move with the scanner's random numbers
  };
  const std::vector<frozen> all = {{"plot_1", 30913, 2.1882582, {1.864677, 1.885329, 1.901857, 1.916141}},
                                   {"plot_2", 31142, 3.2117994, {1.864677, 1.885329, 1.901857, 1.920312}},
                                   {"harvest_40", 27255, 0.2452327, {1.006049, 1.864184, 1.881204, 1.894718}},
                                   {"mobile", 37069, -10.7039226, {7.158925, 7.759983, 2.690721, 1.044883}}};
  for (const frozen& known : all) {
    INFO(known.scene);
    simulation sim(small_cut(known.scene));
    const simulated_scan now = sim.scan(1);
    // At an edge a last bit decides what a ray hits, and which random numbers the next ones get.
    CHECK(double(now.points.size()) == Approx(double(known.count)).epsilon(0.0005));
    CHECK(fingerprint(now.points) == Approx(known.points).epsilon(0).margin(0.01));
    for (std::size_t i = 0; i < known.ranges.size(); ++i)
      CHECK(now.points[i].norm() == Approx(known.ranges[i]).epsilon(0).margin(0.001));
  }
}

}  // namespace globalmatch::support::test_frozen_scenes

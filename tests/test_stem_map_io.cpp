#include "globalmatch/stem_map_io.hpp"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <numbers>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/registration.hpp"
#include "made_up_maps.hpp"
#include "stem_map_bytes.hpp"
#include "support/message_of.hpp"
#include "support/scan_files.hpp"

namespace globalmatch::test_stem_map_io {

using namespace detail;

using Eigen::Vector3d;
using layout = stem_map_layout;

namespace {

/// The bits of values without padding.
template <class T>
bool same(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}
bool same(const stem& a, const stem& b) {
  return same(a.position, b.position) && same(a.axis, b.axis) && same(a.radius, b.radius) &&
         same(a.radius_sigma, b.radius_sigma) && same(a.taper, b.taper) &&
         same(a.position_sigma, b.position_sigma) && same(a.height_sigma, b.height_sigma) &&
         same(a.quality, b.quality) && a.ground_seen == b.ground_seen && a.ground_points == b.ground_points;
}
template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         std::equal(a.begin(), a.end(), b.begin(), [](const T& x, const T& y) { return same(x, y); });
}
bool same(const ground_funnel& a, const ground_funnel& b) {
  return a.points == b.points && a.not_finite == b.not_finite && a.low_points == b.low_points &&
         a.cells == b.cells && a.cells_apart == b.cells_apart && a.low_outliers == b.low_outliers &&
         a.unreachable == b.unreachable && a.ground_points == b.ground_points &&
         same(a.coordinate_step, b.coordinate_step);
}
bool same(const mapping_funnel& a, const mapping_funnel& b) {
  return same(a.ground, b.ground) && a.understory == b.understory && a.by_cells == b.by_cells &&
         a.thinned == b.thinned && a.stem_points == b.stem_points && a.clusters == b.clusters &&
         a.cylinders == b.cylinders && a.likely == b.likely && a.stems == b.stems;
}

void check_same_stems(const stem_map& a, const stem_map& b) {
  CHECK(same(a.stems, b.stems));
  CHECK(same(a.up, b.up));
  CHECK(same(a.given_up, b.given_up));
  CHECK(a.up_by_stems == b.up_by_stems);
  REQUIRE(a.upright.has_value() == b.upright.has_value());
  if (a.upright) CHECK((same(a.upright->up, b.upright->up) && same(a.upright->sigma, b.upright->sigma)));
  CHECK(same(a.spacing_near, b.spacing_near));
  CHECK(same(a.spacing_far, b.spacing_far));
  CHECK(same(a.distance_tolerance, b.distance_tolerance));
  CHECK(same(a.funnel, b.funnel));
  CHECK(a.cancelled == b.cancelled);
  CHECK(same(a.terrain.frame, b.terrain.frame));
  CHECK(same(a.terrain.resolution, b.terrain.resolution));
  CHECK((a.terrain.columns == b.terrain.columns && a.terrain.rows == b.terrain.rows));
  CHECK(same(a.terrain.heights, b.terrain.heights));
  CHECK(a.terrain.has_data == b.terrain.has_data);
  CHECK(a.terrain.in_surface == b.terrain.in_surface);
  CHECK((a.terrain.status == b.terrain.status && a.terrain.cut_off == b.terrain.cut_off));
}

void check_same(const stem_map& a, const stem_map& b) {
  check_same_stems(a, b);
  CHECK(same(a.terrain.ground, b.terrain.ground));
  CHECK(a.terrain.first_ground == b.terrain.first_ground);
  CHECK(same(a.ground_samples, b.ground_samples));
  CHECK(same(a.stem_samples, b.stem_samples));
  CHECK(same(a.stem_normals, b.stem_normals));
  CHECK(same(a.visible.scanner, b.visible.scanner));
  CHECK(a.visible.ranges == b.visible.ranges);
}

void check_round_trip(const stem_map& map) {
  const std::string bytes = bytes_of(map, some_provenance);
  const stem_map_file file = read_back(bytes);
  check_same(file.map, map);
  CHECK(file.provenance == some_provenance);
  CHECK(bytes_of(file.map, file.provenance) == bytes);
  check_same_stems(read_back(bytes, stem_map_file::parts::stems).map, map);
}

/// A plot seen from afar in projected coordinates, with a vertical of its own.
stem_map mapped_plot(const Vector3d& shift, double tilt, std::uint64_t seed = 1) {
  const Eigen::AngleAxisd turn(tilt, Vector3d(1, 2, 0).normalized());
  std::vector<Vector3d> scan;
  for (const Eigen::Vector3f& p : scenes::small_plot(seed).scan())
    scan.push_back(turn * p.cast<double>() + shift);
  return map_stems(scan, {}, turn * Vector3d::UnitZ());
}

bool same_registration(const registration& a, const registration& b) {
  REQUIRE(a.target_from_source.has_value() == b.target_from_source.has_value());
  if (a.target_from_source) {
    CHECK(same(a.target_from_source->matrix(), b.target_from_source->matrix()));
    CHECK(same(a.matching.target_from_source->matrix(), b.matching.target_from_source->matrix()));
    REQUIRE((a.icp.has_value() && b.icp.has_value()));
    CHECK(same(a.icp->target_from_source.matrix(), b.icp->target_from_source.matrix()));
    const Eigen::MatrixXd of_a = a.matching.uncertainty->covariance,
                          of_b = b.matching.uncertainty->covariance;
    REQUIRE(of_a.rows() == of_b.rows());
    CHECK(of_a == of_b);
    CHECK(same(a.matching.vertical->sigma, b.matching.vertical->sigma));
  }
  return a.outcome == b.outcome && a.reason == b.reason && a.refined == b.refined &&
         same(a.matching.probability, b.matching.probability);
}

stem_map with_view(stem_map map) {
  map.visible.scanner = {10.5, 20.25, 1.75};
  map.visible.ranges.resize(std::size_t(visible_ranges::columns * visible_ranges::rows));
  for (std::size_t i = 0; i < map.visible.ranges.size(); ++i)
    map.visible.ranges[i] = static_cast<std::uint16_t>(i);
  return map;
}

stem_map copy_by_file(const stem_map& map) {
  return read_back(bytes_of(map)).map;
}

}  // namespace

TEST_CASE("maps are read back bit for bit, and written again with the same bytes") {
  check_round_trip({});
  stem_map cancelled;
  cancelled.cancelled = true;
  check_round_trip(cancelled);
  check_round_trip(map_of_one_stem());
  check_round_trip(with_view(map_of_one_stem()));
  random_source random(1);
  const scenes::two_maps_of_a_stand maps(random);
  check_round_trip(maps.source);
  check_round_trip(maps.target);
  check_round_trip(mapped_plot({0, 0, 0}, 0));
  check_round_trip(mapped_plot({500'000.1, 5'300'000.2, 700.3}, 0));
  check_round_trip(mapped_plot({500'000.1, 5'300'000.2, 700.3}, 0.4));
  check_round_trip(mapped_plot({-0.1, 0.2, 0.3}, std::numbers::pi));  // without ground: upside down
}

TEST_CASE("the support of stems is not written") {
  CHECK(read_back(bytes_of(map_of_one_stem())).map.stems.front().support.empty());
}

TEST_CASE("samples that mapping made in a frame that only shifts take half the bytes of doubles") {
  const auto bytes_a_sample = [](const stem_map& map) {
    output_archive archive;
    write_samples(archive, map.stem_samples, map.terrain.frame);
    REQUIRE(map.stem_samples.size() > 1000);
    return double(archive.bytes().size() - 9) / double(map.stem_samples.size());
  };
  const Vector3d far(500'000.1, 5'300'000.2, 700.3);
  for (const Vector3d& shift : {Vector3d(0, 0, 0), far}) {
    const stem_map map = mapped_plot(shift, 0);
    CHECK(are_samples_of(map.terrain.ground, map.terrain.frame, map.ground_samples));
    CHECK(bytes_a_sample(map) == 12);
  }
  const stem_map tilted = mapped_plot(far, 0.3);
  CHECK_FALSE(are_samples_of(tilted.terrain.ground, tilted.terrain.frame, tilted.ground_samples));
  CHECK(bytes_a_sample(tilted) == 24);
}

TEST_CASE("a sample that no float gives makes all samples doubles, which keep their bits") {
  local_frame frame;
  frame.origin = {10, 20, 30};
  const auto round_trip = [&](const std::vector<Vector3d>& samples) {
    output_archive out;
    write_samples(out, samples, frame);
    input_archive in(out.bytes(), "these samples");
    std::vector<Vector3d> back;
    read_samples(in, back, frame);
    in.finish();
    CHECK(same(back, samples));
    return out.bytes().size();
  };
  CHECK(round_trip({{10, 20, 30}, {10.5, 19.25, -30}}) == 9 + 2 * 12);
  for (const Vector3d& awkward :
       {Vector3d(0.1, 0.2, 0.3), Vector3d(-0.0, 20, 30), Vector3d(1e300, 0, 0), Vector3d(10, 20, 5e-324)})
    CHECK(round_trip({{10, 20, 30}, awkward}) == 9 + 2 * 24);
  frame.rotation = rotation_about_z(0.1);  // levelled, but it does not only shift
  CHECK(round_trip({{10, 20, 30}}) == 9 + 24);
}

TEST_CASE("what is registered by maps read back has the bits of what is registered by the maps") {
  random_source random(3);
  const scenes::two_maps_of_a_stand made_up(random);
  CHECK(same_registration(register_maps(made_up.source, made_up.target),
                          register_maps(copy_by_file(made_up.source), copy_by_file(made_up.target))));
  const stem_map source = mapped_plot({500'000.1, 5'300'000.2, 700.3}, 0.3),
                 target = mapped_plot({0, 0, 0}, 0);
  const registration mapped = register_maps(source, target);
  REQUIRE(mapped.outcome == outcome::registered);
  CHECK(same_registration(mapped, register_maps(copy_by_file(source), copy_by_file(target))));
  const stem_map other = mapped_plot({0, 0, 0}, 0, 2);
  CHECK(same_registration(register_maps(source, other),
                          register_maps(copy_by_file(source), copy_by_file(other))));
}

TEST_CASE("stems alone are those of the whole file, without samples and ground points") {
  const stem_map map = mapped_plot({0, 0, 0}, 0);
  const std::string bytes = bytes_of(map, some_provenance);
  const auto [stems, provenance] = read_back(bytes, stem_map_file::parts::stems);
  check_same_stems(stems, map);
  CHECK(provenance == some_provenance);
  CHECK((stems.ground_samples.empty() && stems.stem_samples.empty() && stems.stem_normals.empty()));
  CHECK((stems.terrain.ground.empty() && stems.terrain.first_ground.empty()));
  stems.terrain.for_each_ground_near(5, 5, 2, [](const vec3f&) { FAIL("there are no ground points"); });

  const auto [nothing, of_it] = read_back(bytes, stem_map_file::parts::provenance);
  CHECK(of_it == some_provenance);
  check_same(nothing, stem_map());
}

TEST_CASE("values that contradict each other are errors, though their checksums fit") {
  const std::string bytes = bytes_of(map_of_one_stem());
  const auto with_byte = [&](std::size_t section, std::size_t at, char value) {
    std::string changed = bytes;
    changed[layout::begin(bytes, section) + at] = value;
    seal_stem_map(changed);
    return error_of(changed);
  };
  REQUIRE(with_byte(1, 0, 1).empty());
  CHECK(says(with_byte(1, 0, 2), "neither 0 nor 1"));  // cancelled
  const std::size_t frame = 12 * sizeof(double), columns = frame + sizeof(double);
  REQUIRE(with_byte(3, columns, 3).empty());
  CHECK(says(with_byte(3, columns, 4), "heights must hold columns x rows"));
  CHECK(says(with_byte(3, columns + 3, '\x80'), "must not be negative"));
  CHECK(says(with_byte(3, columns + 9, 3), "a choice that there is not"));  // status
  CHECK(says(with_byte(3, frame + 7, '\xFF'), "resolution must be"));
  CHECK(says(with_byte(4, 8 + 24 + 8 + 4, 3), "first_ground must increase"));
  CHECK(says(with_byte(5, 0, 2), "neither 0 nor 1"));
  std::string not_finite = bytes;
  store_little_endian(std::numeric_limits<float>::quiet_NaN(), &not_finite[layout::begin(bytes, 5) + 2 + 8]);
  seal_stem_map(not_finite);
  CHECK(says(error_of(not_finite), "samples and normals must be finite"));
}

TEST_CASE("a map that contradicts itself is not written at all") {
  using support::message_of;
  const auto message = [](const auto& change) {
    stem_map map = map_of_one_stem();
    change(map);
    std::ostringstream out;
    const std::string said = message_of([&] { write_stem_map(out, map); });
    CHECK(out.str().empty());
    return said;
  };
  CHECK(says(message([](stem_map& m) { m.terrain.heights.pop_back(); }), "heights must hold"));
  CHECK(says(message([](stem_map& m) { m.terrain.has_data.clear(); }), "has_data must hold"));
  CHECK(says(message([](stem_map& m) { m.terrain.in_surface.pop_back(); }), "in_surface must hold"));
  CHECK(says(message([](stem_map& m) { m.terrain.rows = -2; }), "must not be negative"));
  CHECK(says(message([](stem_map& m) { m.terrain.resolution = 0; }), "resolution must be"));
  CHECK(says(message([](stem_map& m) { m.terrain.ground.clear(); }), "first_ground must increase"));
  CHECK(says(message([](stem_map& m) { m.terrain.first_ground.pop_back(); }), "first_ground must hold"));
  CHECK(says(message([](stem_map& m) { m.visible.ranges = {1, 2}; }), "ranges must hold"));
  CHECK(says(message([](stem_map& m) { m.stem_samples[0].x() = std::numeric_limits<double>::infinity(); }),
             "must be finite"));
}

TEST_CASE("files of each version are read by every later version, and on every platform") {
  std::string bytes;
  for (const std::string version : {"1", "2"}) {
    std::ifstream in(std::string(GLOBALMATCH_TEST_DATA) + "/version_" + version + ".gmap", std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
    REQUIRE_FALSE(bytes.empty());
    const stem_map_file file = read_back(bytes);
    check_same(file.map, map_of_one_stem());
    CHECK(file.provenance == some_provenance);
  }
  CHECK(bytes_of(map_of_one_stem(), some_provenance) == bytes);  // as long as 2 is what is written
}

TEST_CASE("what the scanner saw is read with the samples, and checked") {
  const stem_map map = with_view(map_of_one_stem());
  const std::string bytes = bytes_of(map);
  CHECK(read_back(bytes, stem_map_file::parts::stems).map.visible.empty());
  const std::size_t view = layout::begin(bytes, 6);
  std::string damaged = bytes;
  store_little_endian(std::numeric_limits<double>::infinity(), &damaged[view]);
  seal_stem_map(damaged);
  CHECK(says(error_of(damaged), "the scanner's place must be finite"));
  damaged = bytes.substr(0, bytes.size() - 2);
  const std::uint64_t fewer = map.visible.ranges.size() - 1;
  store_little_endian(fewer, &damaged[view + 3 * sizeof(double)]);
  store_little_endian(3 * sizeof(double) + sizeof(fewer) + 2 * fewer, &damaged[layout::length_at(6)]);
  seal_stem_map(damaged);
  CHECK(says(error_of(damaged), "ranges must hold columns x rows values"));
}

TEST_CASE("maps of real scans are read back and registered with the same bits", "[slow]") {
  const auto clouds = std::filesystem::path(GLOBALMATCH_SHARED_DATA) / "clouds";
  if (!std::filesystem::exists(clouds)) {
    WARN("skipped: no real scans in " << clouds);
    return;
  }
  for (const std::string pair : {"pine_plot_virtualscans", "dense_conifers_interleaved"}) {
    const stem_map source = map_stems(support::open_scan(clouds / (pair + "_src.ply")));
    const stem_map target = map_stems(support::open_scan(clouds / (pair + "_tgt.ply")));
    REQUIRE(source.stems.size() > 10);
    check_round_trip(source);
    check_round_trip(target);
    CHECK(are_samples_of(source.terrain.ground, source.terrain.frame, source.ground_samples));
    CHECK(same_registration(register_maps(source, target),
                            register_maps(copy_by_file(source), copy_by_file(target))));
  }
}

}  // namespace globalmatch::test_stem_map_io

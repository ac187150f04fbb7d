// What is usually wrong with stem maps, and how one knows that it was named.
#pragma once

#include "diagnoses.hpp"
#include "stem_layouts.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

/// Whether a diagnosis names a fault of the map "source" or "target".
using naming = std::function<bool(const diagnosis&, const std::string& spoilt)>;

/// What is spoilt: the forest, where both maps are as wrong as each other.
enum class place_of_fault { one_map, both_maps, forest };

struct fault {
  std::string_view name;
  std::string_view code;  ///< of the warning that names it
  std::function<void(positions&, random_source&)> spoil;
  naming is_named;
  place_of_fault place = place_of_fault::one_map;
  std::size_t min_trees = 40, max_trees = 120;  ///< of each map
  std::string_view columns = "x,y,z";
};

inline auto times(double x, double y, double z) {
  return [=](positions& stems, random_source&) {
    for (Eigen::Vector3d& p : stems) p = p.cwiseProduct(Eigen::Vector3d(x, y, z));
  };
}

/// Appends the copies.
inline auto listed_twice(double apart) {
  return [=](positions& stems, random_source& random) {
    const std::size_t size = stems.size();
    for (std::size_t i = 0; i < size; ++i) stems.push_back(stems[i] + gaussian(random, apart));
  };
}

inline void swap_axes(positions& stems, random_source&) {
  for (Eigen::Vector3d& p : stems) std::swap(p.x(), p.y());
}

/// As made from metres in a local frame, on a sphere.
inline void make_degrees(positions& stems, random_source&) {
  constexpr double meridian = 111.2e3, longitude = 15.3, latitude = 62.2;  // [m/deg], [deg]
  const double parallel = meridian * std::cos(latitude * std::numbers::pi / 180);
  for (Eigen::Vector3d& p : stems) p = {longitude + p.x() / parallel, latitude + p.y() / meridian, p.z()};
}

inline void take_tree_heights(positions& stems, random_source& random) {
  for (Eigen::Vector3d& p : stems) p.z() = 20 + 5 * random.normal();
}

inline naming says(std::string_view code, std::string_view text) {
  return [=](const diagnosis& d, const std::string&) { return d.says(code, text); };
}

/// By what the stems of the map look like, or by the factor they fit with.
inline naming names_unit(std::string_view unit) {
  return [=](const diagnosis& d, const std::string& spoilt) {
    return d.says("reason", spoilt + " in " + std::string(unit)) ||
           (d.says("reason", unit) && d.result.reason.starts_with(spoilt + ": "));
  };
}

/// With a factor of which the difference from 1 is right to a fifth, or within four standard deviations.
inline naming names_scale(double factor, std::string_view text) {
  return [=](const diagnosis& d, const std::string& spoilt) {
    if (!d.says("scale", text)) return false;
    const double truth = spoilt == "target" ? factor : 1 / factor;
    const scale_estimate& found = *d.result.scale;
    return std::abs(found.factor - truth) < std::max(0.2 * std::abs(truth - 1), 4 * found.sigma);
  };
}

/// Nine in ten copies.
inline bool names_copies(const diagnosis& d, const std::string& spoilt) {
  const matching_funnel& f = d.result.funnel;
  const bool of_source = spoilt == "source";
  const auto found = double(of_source ? f.source_coincident : f.target_coincident),
             stems = double(of_source ? f.source_stems : f.target_stems);
  return found > 0.45 * stems && d.says("coincident_stems", spoilt + ": ");
}

inline std::vector<fault> usual_faults() {
  using enum place_of_fault;
  constexpr double feet = 1 / 0.3048, percent = 1.01, projection = 1.0004;
  const auto longer = times(percent, percent, 1), projected = times(projection, projection, 1);
  const naming says_projection = names_scale(projection, "map projection"),
               says_wrong_heights = says("height_unknown", "not all of them are heights of the ground");
  return {
      {"x and y swapped", "reason", swap_axes, says("reason", "mirror image")},
      {"feet", "reason", times(feet, feet, feet), names_unit("feet")},
      {"centimetres", "reason", times(100, 100, 100), names_unit("centimetres")},
      {"millimetres", "reason", times(1000, 1000, 1000), names_unit("millimetres")},
      {"both in millimetres", "reason", times(1000, 1000, 1000), names_unit("millimetres"), both_maps},
      {"degrees as x and y", "reason", make_degrees, names_unit("degrees")},
      {"both in degrees as x and y", "reason", make_degrees, names_unit("degrees"), both_maps},
      {"degrees as lon and lat", "file", make_degrees, says("file", "angles"), one_map, 40, 120, "lon,lat,z"},
      {"1 % longer", "scale", longer, names_scale(percent, "distorted")},
      {"400 ppm longer", "scale", projected, says_projection},
      {"400 ppm longer (500 to 1000 trees)", "scale", projected, says_projection, one_map, 500, 1000},
      {"400 ppm longer (1500 trees)", "scale", projected, says_projection, one_map, 1500, 1500},
      {"tree heights as z", "height_unknown", take_tree_heights, says_wrong_heights},
      {"tree heights as z in both", "height_unknown", take_tree_heights, says_wrong_heights, forest},
      {"each stem twice", "coincident_stems", listed_twice(0), names_copies},
      {"each stem twice (5 cm apart)", "coincident_stems", listed_twice(0.05), names_copies}};
}

}  // namespace globalmatch::benchmarks

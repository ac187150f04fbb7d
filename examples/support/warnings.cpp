#include "support/warnings.hpp"

#include <globalmatch/detail/core/statistics.hpp>
#include <globalmatch/matching.hpp>
#include <globalmatch/stem_map.hpp>

#include <cmath>
#include <iomanip>
#include <numbers>
#include <sstream>

namespace globalmatch::support {

namespace {

constexpr double max_usual_radius = 0.3;  // [m] at breast height, of half of the stems of a stand

/// Of maps of some stems; 0 of others.
double median_radius(const std::vector<stem>& stems) {
  constexpr std::size_t min_stems = 5;
  if (stems.size() < min_stems) return 0;
  std::vector<double> radii;
  for (const stem& s : stems) radii.push_back(s.radius);
  return detail::median(radii);
}

}  // namespace

std::vector<warning> warnings_of(const stem_map& map) {
  std::vector<warning> warnings;
  const auto add = [&](const char* code, const std::string& text) { warnings.push_back({code, text}); };
  if (map.funnel.ground.low_points > 0)
    add("low_noise", std::to_string(map.funnel.ground.low_points) + " points below the ground were left out");
  const bool has_points = map.funnel.ground.cells > 0;
  if (has_points && map.terrain.status == ground_status::none)
    add("no_ground",
        "no ground was seen: heights of stems are those of the lowest points, and off by metres; "
        "where it should be there, is `up` right (0,1,0 for y up)?");
  else if (map.terrain.cut_off)
    add("cut_off",
        "all below some height is missing in part of the scan: heights of stems are known only where "
        "ground was seen");
  if (map.terrain.status == ground_status::normalised)
    add("normalised_heights", "the ground lies at height 0 everywhere: heights are those above the ground");
  if (map.funnel.ground.coordinate_step > 0) {
    std::ostringstream text;
    text << "coordinates come in steps of " << map.funnel.ground.coordinate_step
         << " m: were map coordinates stored as float? Export them as double, or shifted to the scan";
    add("coordinate_step", text.str());
  }
  if (const double radius = median_radius(map.stems); radius > max_usual_radius) {
    std::ostringstream text;
    text << std::setprecision(2) << "half of the stems are thicker than " << 2 * radius
         << " m: are coordinates in feet? Multiply them by 0.3048: metres are needed";
    add("thick_stems", text.str());
  }
  if (map.stems.empty())
    add("no_stems", "no stems were found: " + detail::where_lost(explain(map.funnel), 1));
  return warnings;
}

namespace {

void warn_of_coincident(std::size_t count, std::size_t stems, const char* name,
                        std::vector<warning>& warnings) {
  if (count == 0) return;
  warnings.push_back({"coincident_stems", std::string(name) + ": " + std::to_string(count) + " of " +
                                              std::to_string(stems) +
                                              " stems are at the place of another one and were left out"});
}

/// "1.02 % longer"
std::string describe_length(double factor) {
  constexpr double percent = 100, ppm = 1e6, max_ppm = 2000;
  const double off = std::abs(factor - 1);
  std::ostringstream text;
  if (ppm * off < max_ppm)
    text << std::round(ppm * off) << " ppm";
  else
    text << std::setprecision(3) << percent * off << " %";
  return text.str() + (factor > 1 ? " longer" : " shorter");
}

void warn_of_scale(const scale_estimate& scale, std::vector<warning>& warnings) {
  constexpr double min_projection = 1e-4, max_projection = 1e-3;
  const double off = std::abs(scale.factor - 1);
  std::ostringstream text;
  text << "scale: distances in target are " << describe_length(scale.factor) << " than in source";
  if (scale.is_applied)
    text << "; source was multiplied by " << std::setprecision(7) << scale.factor;
  else if (off > min_projection && off < max_projection)
    text << ": that of a map projection, or drift of a mobile scanner";
  else
    text
        << ": one map is distorted, and the transform a compromise (the option scale of match_stems corrects "
           "stem maps)";
  warnings.push_back({"scale", text.str()});
}

}  // namespace

std::vector<warning> warnings_of(const matching& result) {
  std::vector<warning> warnings;
  const matching_funnel& f = result.funnel;
  warn_of_coincident(f.source_coincident, f.source_stems, "source", warnings);
  warn_of_coincident(f.target_coincident, f.target_stems, "target", warnings);
  if (result.outcome == outcome::registered && result.prior && result.prior->is_contradicted) {
    std::ostringstream text;
    text << std::setprecision(2) << "prior: the stems place the source " << result.prior->distance
         << " m and " << result.prior->turn * 180 / std::numbers::pi
         << " degrees from where it does, beyond doubt; is it of these two, source to target?";
    warnings.push_back({"prior_contradicted", text.str()});
  }
  if (result.scale && result.scale->differs) warn_of_scale(*result.scale, warnings);
  if (!result.vertical) return warnings;
  const vertical_fit& vertical = *result.vertical;
  std::ostringstream degrees;
  degrees << std::setprecision(2) << vertical.tilt * 180 / std::numbers::pi << " degrees";
  if (!vertical.is_known())
    warnings.push_back({"height_unknown", "height: " + vertical.reason});
  else if (vertical.kind == vertical_kind::sloping)
    warnings.push_back({"sloping_heights", "heights of the paired stems slope by " + degrees.str() +
                                               " while both scans are level: those of one are wrong"});
  return warnings;
}

}  // namespace globalmatch::support

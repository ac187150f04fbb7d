#include "support/las_plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <set>

#include "support/file_error.hpp"
#include "support/las_fields.hpp"
#include "support/las_header.hpp"
#include "support/shared_attributes.hpp"

namespace globalmatch::support {

namespace {

constexpr double finest_step = 1e-4, usual_step = 1e-3, coarsest_step = 1e-2;  // [m]

const las_frame* las_of(const placed_scan& scan) {
  return scan.scan->header().las ? &*scan.scan->header().las : nullptr;
}

// The finest step of the files, which where some have none is fine enough for those.
double step_of(std::span<const placed_scan> scans, Eigen::Index axis) {
  std::optional<double> finest;
  bool all_have = true;
  for (const placed_scan& scan : scans) {
    const las_frame* las = las_of(scan);
    all_have = all_have && las;
    if (las) finest = std::min(finest.value_or(INFINITY), std::abs(las->scale[axis]));
  }
  return !finest ? finest_step : all_have ? *finest : std::min(*finest, usual_step);
}

bool holds(double step, double offset, double min, double max) {
  constexpr double most = std::numeric_limits<std::int32_t>::max();
  return std::abs(min - offset) / step < most && std::abs(max - offset) / step < most;
}

// Keeps the offset of the first scan where that leaves room, so that its points keep their integers.
void choose_axis(const std::filesystem::path& path, std::span<const placed_scan> scans,
                 const points_extent& extent, Eigen::Index axis, coordinate_grid& grid) {
  const double min = extent.count > 0 ? extent.min[axis] : 0, max = extent.count > 0 ? extent.max[axis] : 0;
  const las_frame* first = las_of(scans.front());
  const double finest = step_of(scans, axis);
  const double middle = std::round(min + (max - min) / 2);
  for (double step = finest; step <= std::max(finest, coarsest_step) * 1.001; step *= 10)
    for (const double offset : {first ? first->offset[axis] : std::round(min), middle})
      if (holds(step, offset, min, max)) {
        grid.scale[axis] = step;
        grid.offset[axis] = offset;
        return;
      }
  throw file_error(path,
                   "cannot hold coordinates from " + std::to_string(min) + " to " + std::to_string(max) +
                       " m in steps of 1 cm",
                   "Remove stray points, or write .ply");
}

const record_field* find_field(const std::vector<record_field>& fields, const std::string& name) {
  const auto at =
      std::find_if(fields.begin(), fields.end(), [&](const auto& f) { return f.what.name == name; });
  return at == fields.end() ? nullptr : &*at;
}

bool is_color(const std::string& name) {
  return name == "red" || name == "green" || name == "blue" || name == "near_infrared";
}

// What values in other formats mean. LAS wants colours and intensities that use 16 bits; those from 0 to 1,
// and colours of 8 bits, are scaled so.
void normalize(attribute& what, const value_range& range) {
  const bool is_unit = range.min >= 0 && range.max <= 1 && !range.is_whole;
  if (is_color(what.name) && !is_unit && range.max <= 255 && what.type != scalar::uint16) {
    what.scale *= 257;
    what.offset *= 257;
  } else if (is_unit && (is_color(what.name) || what.name == "intensity")) {
    what.scale *= 65535;
    what.offset *= 65535;
  }
}

bool fits(const std::string& name, const value_range& range, const record_field& field) {
  if (field.what.type == scalar::float64) return true;
  if (is_color(name) || name == "intensity") return range.min >= 0 && range.max <= 65535;
  if (name == "scan_angle")  // rounded to the unit of the format
    return std::abs(range.min) <= 180 && std::abs(range.max) <= 180 &&
           (field.what.scale != 1 || (range.is_whole && std::abs(range.min) <= 128 && range.max <= 127));
  const double max = field.bits > 0                     ? (1u << field.bits) - 1.0
                     : field.what.type == scalar::uint8 ? 255
                                                        : 65535;
  return range.is_whole && range.min >= 0 && range.max <= max;
}

/// Which attributes have a place in the short records of LAS 1.2, and in the long ones of LAS 1.4.
struct attribute_places {
  std::vector<shared_attribute> with_field, extra;
  bool is_long = false;
};

// The values of an attribute in scans that are not LAS; those of colours together.
std::vector<value_range> ranges_of(std::span<const placed_scan> scans,
                                   const std::vector<shared_attribute>& all, const shared_attribute& shared,
                                   int threads) {
  std::vector<value_range> ranges(scans.size());
  for (const shared_attribute& other : all) {
    if (&other != &shared && !(is_color(other.name) && is_color(shared.name))) continue;
    for (std::size_t s = 0; s < scans.size(); ++s) {
      if (las_of(scans[s]) || !other.of_scan[s]) continue;
      const value_range range = range_of(*scans[s].scan, *other.of_scan[s], threads);
      ranges[s].min = std::min(ranges[s].min, range.min);
      ranges[s].max = std::max(ranges[s].max, range.max);
      ranges[s].is_whole = ranges[s].is_whole && range.is_whole;
    }
  }
  return ranges;
}

// Attributes whose values do not fit are extra bytes under another name.
attribute_places place_attributes(std::span<const placed_scan> scans, int threads) {
  static const std::vector<record_field> short_fields = las_fields(3), long_fields = las_fields(8);
  attribute_places places;
  for (const placed_scan& scan : scans) places.is_long |= las_of(scan) && las_of(scan)->format >= 6;
  const std::vector<shared_attribute> all = share_attributes(scans);
  for (const shared_attribute& given : all) {
    shared_attribute shared = given;
    const record_field* long_field = find_field(long_fields, shared.name);
    const record_field* short_field = find_field(short_fields, shared.name);
    const auto all_fit = [&](const record_field* field, const std::vector<value_range>& ranges) {
      for (std::size_t s = 0; s < scans.size() && field; ++s)
        if (!las_of(scans[s]) && shared.of_scan[s] && !fits(shared.name, ranges[s], *field)) return false;
      return field != nullptr;
    };
    const auto ranges = long_field ? ranges_of(scans, all, given, threads) : std::vector<value_range>();
    if (!all_fit(long_field, ranges)) {
      if (long_field) shared.name += "_value";
      places.extra.push_back(std::move(shared));
      continue;
    }
    places.is_long = places.is_long || !all_fit(short_field, ranges);
    for (std::size_t s = 0; s < scans.size(); ++s)
      if (!las_of(scans[s]) && shared.of_scan[s]) normalize(shared.of_scan[s]->what, ranges[s]);
    places.with_field.push_back(std::move(shared));
  }
  return places;
}

// Formats 0 to 3 of LAS 1.2, which all programs read, and which keep the bits of all files that have them.
// Formats 6 to 8 of LAS 1.4 where one of the files has them, or an attribute needs them.
unsigned choose_format(const attribute_places& places, std::size_t count) {
  const auto has = [&](const std::string& name) {
    return std::any_of(places.with_field.begin(), places.with_field.end(),
                       [&](const shared_attribute& a) { return a.name == name; });
  };
  const bool has_color = has("red") || has("green") || has("blue");
  const bool is_long = places.is_long || count > std::numeric_limits<std::uint32_t>::max();
  if (is_long) return has("near_infrared") ? 8 : has_color ? 7 : 6;
  return (has("gps_time") ? 1u : 0u) + (has_color ? 2u : 0u);
}

void add_field(const shared_attribute& shared, const record_field& to, std::vector<scan_plan>& scans) {
  for (std::size_t s = 0; s < scans.size(); ++s)
    if (shared.of_scan[s]) scans[s].fields.push_back({shared.of_scan[s]->index, shared.of_scan[s]->what, to});
}

void plan_records(const attribute_places& places, std::size_t scans, las_plan& plan) {
  std::size_t& size = plan.records.record_size = las_format_size(plan.format);
  plan.records.scans.resize(scans);
  const std::vector<record_field> fields = las_fields(plan.format);
  for (const shared_attribute& shared : places.with_field)
    add_field(shared, *find_field(fields, shared.name), plan.records.scans);
  plan.extra_fields.push_back({{"scan", scalar::uint8}, size++});
  std::set<std::string> names = {"scan"};
  for (const shared_attribute& shared : places.extra) {
    plan.extra_fields.push_back({common_storage(shared, true), size});
    std::string& name = plan.extra_fields.back().what.name;
    for (std::size_t k = 2; !names.insert(name).second; ++k) name = shared.name + '_' + std::to_string(k);
    size += size_of(plan.extra_fields.back().what.type);
    add_field(shared, plan.extra_fields.back(), plan.records.scans);
  }
  for (std::size_t s = 0; s < scans; ++s) {
    plan.records.scans[s].prototype.assign(size, '\0');
    plan.records.scans[s].prototype[plan.extra_fields.front().offset] = static_cast<char>(s + 1);
  }
}

// Kinds of time and projections cannot differ in one file: the first one that has any gives them.
void copy_frame(std::span<const placed_scan> scans, las_plan& plan) {
  constexpr std::uint16_t is_standard_time = 1, is_wkt = 16;
  const auto with_las = std::find_if(scans.begin(), scans.end(), las_of);
  if (with_las != scans.end()) plan.encoding = las_of(*with_las)->encoding & is_standard_time;
  if (const las_frame* las = las_of(scans.front())) plan.projection = las->projection;
  const bool has_wkt = std::any_of(plan.projection.begin(), plan.projection.end(),
                                   [](const auto& record) { return record.first == 2112; });
  if (plan.format >= 6 && (has_wkt || plan.projection.empty())) plan.encoding |= is_wkt;
}

}  // namespace

las_plan plan_las(const std::filesystem::path& path, std::span<const placed_scan> scans,
                  const points_extent& extent, int threads) {
  const attribute_places places = place_attributes(scans, threads);
  las_plan plan;
  plan.format = choose_format(places, extent.count);
  plan.minor_version = plan.format >= 6 ? 4 : 2;
  plan_records(places, scans.size(), plan);
  constexpr std::size_t max_described = 65535 / extra_description_size;
  if (plan.extra_fields.size() > max_described || plan.records.record_size > 65535)
    throw file_error(path,
                     "cannot describe the " + std::to_string(plan.extra_fields.size()) +
                         " attributes that have no place of their own in LAS",
                     "Write .ply, or leave some of them out of the scans");
  coordinate_grid grid;
  for (Eigen::Index axis = 0; axis < 3; ++axis) choose_axis(path, scans, extent, axis, grid);
  plan.records.grid = grid;
  copy_frame(scans, plan);
  return plan;
}

}  // namespace globalmatch::support

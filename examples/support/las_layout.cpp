#include "support/las_layout.hpp"

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

using ranges_of_scans = std::vector<value_range>;

// The values of all attributes of scans that are not LAS, if LAS has a place for them; those of colours
// together.
std::vector<ranges_of_scans> find_ranges(std::span<const placed_scan> scans,
                                         const std::vector<shared_attribute>& all,
                                         const std::vector<record_field>& fields, int threads) {
  std::vector<ranges_of_scans> ranges(all.size(), ranges_of_scans(scans.size()));
  ranges_of_scans of_colors(scans.size());
  for (std::size_t k = 0; k < all.size(); ++k)
    for (std::size_t s = 0; s < scans.size(); ++s) {
      if (las_of(scans[s]) || !all[k].of_scan[s] || !find_field(fields, all[k].name)) continue;
      ranges[k][s] = range_of(*scans[s].scan, *all[k].of_scan[s], threads);
      if (is_color(all[k].name)) of_colors[s].include(ranges[k][s]);
    }
  for (std::size_t k = 0; k < all.size(); ++k)
    if (is_color(all[k].name)) ranges[k] = of_colors;
  return ranges;
}

bool has_any(const shared_attribute& shared) {
  return std::any_of(shared.of_scan.begin(), shared.of_scan.end(),
                     [](const auto& of) { return of.has_value(); });
}

// Attributes of scans whose values do not fit are extra bytes under another name.
attribute_places place_attributes(std::span<const placed_scan> scans, int threads) {
  static const std::vector<record_field> short_fields = las_fields(3), long_fields = las_fields(8);
  const std::vector<shared_attribute> all = share_attributes(scans);
  const std::vector<ranges_of_scans> ranges = find_ranges(scans, all, long_fields, threads);
  attribute_places places;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const std::string& name = all[k].name;
    const record_field* long_field = find_field(long_fields, name);
    const record_field* short_field = find_field(short_fields, name);
    shared_attribute in_field{name, {scans.size(), std::nullopt}};
    shared_attribute extra{long_field ? name + "_value" : name, {scans.size(), std::nullopt}};
    for (std::size_t s = 0; s < scans.size(); ++s) {
      if (!all[k].of_scan[s]) continue;
      const bool is_las = las_of(scans[s]) != nullptr;
      const auto has_place = [&](const record_field* f) {
        return f && (is_las || fits(name, ranges[k][s], *f));
      };
      shared_attribute& place = has_place(long_field) ? in_field : extra;
      place.of_scan[s] = all[k].of_scan[s];
      if (&place == &extra) continue;
      if (!is_las) normalize(place.of_scan[s]->what, ranges[k][s]);
      places.is_long = places.is_long || !has_place(short_field) || (is_las && las_of(scans[s])->format >= 6);
    }
    if (has_any(in_field)) places.with_field.push_back(std::move(in_field));
    if (has_any(extra)) places.extra.push_back(std::move(extra));
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

void add_field(const shared_attribute& shared, const record_field& to, std::vector<scan_records>& scans) {
  for (std::size_t s = 0; s < scans.size(); ++s)
    if (shared.of_scan[s]) scans[s].fields.push_back({shared.of_scan[s]->index, shared.of_scan[s]->what, to});
}

void add_records(const attribute_places& places, std::size_t scans, las_layout& layout) {
  std::size_t& size = layout.records.record_size = las_format_size(layout.format);
  layout.records.scans.resize(scans);
  const std::vector<record_field> fields = las_fields(layout.format);
  for (const shared_attribute& shared : places.with_field)
    add_field(shared, *find_field(fields, shared.name), layout.records.scans);
  const scalar number = scans <= 255 ? scalar::uint8 : scalar::uint32;
  layout.extra_fields.push_back({{"scan", number}, size});
  size += size_of(number);
  std::set<std::string> names = {"scan"};
  for (const shared_attribute& shared : places.extra) {
    layout.extra_fields.push_back({common_storage(shared, true), size});
    std::string& name = layout.extra_fields.back().what.name;
    for (std::size_t k = 2; !names.insert(name).second; ++k) name = shared.name + '_' + std::to_string(k);
    size += size_of(layout.extra_fields.back().what.type);
    add_field(shared, layout.extra_fields.back(), layout.records.scans);
  }
  for (std::size_t s = 0; s < scans; ++s) {
    layout.records.scans[s].prototype.assign(size, '\0');
    put_missing(layout.extra_fields, layout.records.scans[s]);
    for (std::size_t byte = 0; byte < size_of(number); ++byte)
      layout.records.scans[s].prototype[layout.extra_fields.front().offset + byte] =
          static_cast<char>((s + 1) >> (8 * byte));
  }
}

// Kinds of time and projections cannot differ in one file: the first one that has any gives them.
void copy_frame(std::span<const placed_scan> scans, las_layout& layout) {
  constexpr std::uint16_t is_standard_time = 1, is_wkt = 16;
  const auto with_las = std::find_if(scans.begin(), scans.end(), las_of);
  if (with_las != scans.end()) layout.encoding = las_of(*with_las)->encoding & is_standard_time;
  if (const las_frame* las = las_of(scans.front())) layout.projection = las->projection;
  const bool has_wkt = std::any_of(layout.projection.begin(), layout.projection.end(),
                                   [](const auto& record) { return record.first == 2112; });
  if (layout.format >= 6 && (has_wkt || layout.projection.empty())) layout.encoding |= is_wkt;
}

}  // namespace

las_layout make_las_layout(const std::filesystem::path& path, std::span<const placed_scan> scans,
                           const points_extent& extent, int threads) {
  const attribute_places places = place_attributes(scans, threads);
  las_layout layout;
  layout.format = choose_format(places, extent.count);
  layout.minor_version = layout.format >= 6 ? 4 : 2;
  add_records(places, scans.size(), layout);
  constexpr std::size_t max_described = 65535 / extra_description_size;
  if (layout.extra_fields.size() > max_described || layout.records.record_size > 65535)
    throw file_error(path,
                     "cannot describe the " + std::to_string(layout.extra_fields.size()) +
                         " attributes that have no place of their own in LAS",
                     "Write .ply, or leave some of them out of the scans");
  coordinate_grid grid;
  for (Eigen::Index axis = 0; axis < 3; ++axis) choose_axis(path, scans, extent, axis, grid);
  layout.records.grid = grid;
  copy_frame(scans, layout);
  return layout;
}

}  // namespace globalmatch::support

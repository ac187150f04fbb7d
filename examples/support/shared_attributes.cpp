#include "support/shared_attributes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "globalmatch/detail/core/threads.hpp"

namespace globalmatch::support {

namespace {

std::vector<attribute> named_attributes(const scan_file& scan) {
  std::vector<attribute> attributes = scan.points().attributes();
  std::set<std::string> used;
  for (attribute& a : attributes) {
    // Extra bytes of LAS keep their names: one that is called as an attribute of LAS is none.
    if (!scan.header().las) a.name = common_name(a.name);
    const std::string name = a.name;
    for (std::size_t k = 2; !used.insert(a.name).second; ++k) a.name = name + '_' + std::to_string(k);
  }
  return attributes;
}

value_range range_of_block(const point_source& points, const scan_attribute& of, std::size_t first,
                           std::size_t count) {
  attribute_column column{of.index, {}};
  points.read_attributes(first, count, {&column, 1});
  value_range range{INFINITY, -INFINITY, true};
  visit_type(of.what.type, [&]<class T>(T) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto number =
          static_cast<double>(load<T>(column.numbers.data() + i * sizeof(T), std::endian::native));
      const double value = number * of.what.scale + of.what.offset;
      if (std::isnan(value)) continue;
      range.min = std::min(range.min, value);
      range.max = std::max(range.max, value);
      range.is_whole = range.is_whole && value == std::nearbyint(value);
    }
  });
  return range;
}

}  // namespace

std::vector<shared_attribute> share_attributes(std::span<const placed_scan> scans) {
  std::vector<shared_attribute> shared;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    const std::vector<attribute> attributes = named_attributes(*scans[s].scan);
    for (std::size_t i = 0; i < attributes.size(); ++i) {
      const auto is_this = [&](const shared_attribute& a) { return a.name == attributes[i].name; };
      auto at = std::find_if(shared.begin(), shared.end(), is_this);
      if (at == shared.end())
        at =
            shared.insert(at, {attributes[i].name, std::vector<std::optional<scan_attribute>>(scans.size())});
      at->of_scan[s] = {i, attributes[i]};
    }
  }
  return shared;
}

attribute common_storage(const shared_attribute& shared, bool keep_scale) {
  const attribute* first = nullptr;
  bool is_same = true, is_scaled = false;
  std::vector<scalar> types;
  for (const auto& of : shared.of_scan) {
    if (!of) continue;
    if (!first) first = &of->what;
    is_same = is_same && of->what.type == first->type && of->what.scale == first->scale &&
              of->what.offset == first->offset;
    is_scaled = is_scaled || of->what.scale != 1 || of->what.offset != 0;
    types.push_back(of->what.type);
  }
  if (is_same && (keep_scale || !is_scaled)) return {shared.name, first->type, first->scale, first->offset};
  constexpr std::array candidates = {scalar::uint8,  scalar::int8,   scalar::uint16,
                                     scalar::int16,  scalar::uint32, scalar::int32,
                                     scalar::uint64, scalar::int64,  scalar::float32};
  if (!is_scaled)
    for (const scalar type : candidates)
      if (std::all_of(types.begin(), types.end(), [&](scalar other) { return holds_all_of(type, other); }))
        return {shared.name, type};
  return {shared.name, scalar::float64};
}

void value_range::include(const value_range& other) {
  min = std::min(min, other.min);
  max = std::max(max, other.max);
  is_whole = is_whole && other.is_whole;
}

value_range range_of(const scan_file& scan, const scan_attribute& of, int threads) {
  constexpr std::size_t block = 16 * point_source::block_size;
  std::vector<value_range> ranges((scan.size() + block - 1) / block);
  detail::parallel_for(
      execution{.threads = threads}, "read attributes", ranges.size(),
      [&](std::size_t i) {
        const std::size_t first = i * block;
        ranges[i] = range_of_block(scan.points(), of, first, std::min(block, scan.size() - first));
      },
      1);
  value_range all{INFINITY, -INFINITY, true};
  for (const value_range& range : ranges) all.include(range);
  return all.min > all.max ? value_range{} : all;
}

}  // namespace globalmatch::support

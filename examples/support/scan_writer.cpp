#include "support/scan_writer.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "support/atomic_file.hpp"
#include "support/file_error.hpp"
#include "support/las_layout.hpp"
#include "support/las_writer.hpp"
#include "support/output_records.hpp"
#include "support/shared_attributes.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

std::string extension_of(const std::filesystem::path& path) {
  return lower_case(path.extension().string());
}

std::string_view ply_type(scalar type) {
  constexpr std::string_view names[] = {"char", "uchar", "short",  "ushort", "int",
                                        "uint", "int64", "uint64", "float",  "double"};
  return names[static_cast<std::size_t>(type)];
}

// Names of properties end at a blank; those of coordinates and colours are taken.
std::string ply_name(const std::string& name) {
  const std::string plain = common_name(name);
  for (const char* taken : {"x", "y", "z", "red", "green", "blue"})
    if (plain == taken) return "point_" + plain;
  return plain;
}

output_records make_ply_records(std::span<const placed_scan> scans, std::vector<record_field>& fields) {
  output_records layout;
  fields = {{{"x"}, 0}, {{"y"}, 8}, {{"z"}, 16}};
  layout.record_size = 3 * sizeof(double);
  layout.scans.resize(scans.size());
  for (const char* colour : {"red", "green", "blue"})
    fields.push_back({{colour, scalar::uint8}, layout.record_size++});
  for (const shared_attribute& shared : share_attributes(scans)) {
    record_field to{common_storage(shared, false), layout.record_size};
    // Not all programs read integers of 64 bits.
    if (to.what.type == scalar::int64 || to.what.type == scalar::uint64) to.what.type = scalar::float64;
    to.what.name = ply_name(shared.name);
    while (
        std::any_of(fields.begin(), fields.end(), [&](const auto& f) { return f.what.name == to.what.name; }))
      to.what.name += '_';
    layout.record_size += size_of(to.what.type);
    for (std::size_t s = 0; s < scans.size(); ++s)
      if (shared.of_scan[s])
        layout.scans[s].fields.push_back({shared.of_scan[s]->index, shared.of_scan[s]->what, to});
    fields.push_back(std::move(to));
  }
  for (std::size_t s = 0; s < scans.size(); ++s) {
    layout.scans[s].prototype.assign(layout.record_size, '\0');
    put_missing(fields, layout.scans[s]);
    for (std::size_t k = 0; k < 3; ++k)
      layout.scans[s].prototype[fields[3 + k].offset] = static_cast<char>(scans[s].colour[k]);
  }
  return layout;
}

void write_as_ply(atomic_file& file, std::span<const placed_scan> scans, const points_extent& extent,
                  int threads) {
  std::vector<record_field> fields;
  const output_records layout = make_ply_records(scans, fields);
  file.stream() << "ply\nformat binary_little_endian 1.0\nelement vertex " << extent.count << '\n';
  for (const record_field& field : fields)
    file.stream() << "property " << ply_type(field.what.type) << ' ' << field.what.name << '\n';
  file.stream() << "end_header\n";
  for_each_record(scans, layout, threads, [&](std::span<const char> records) {
    file.stream().write(records.data(), static_cast<std::streamsize>(records.size()));
    file.require_good();
  });
}

void write_as_las(atomic_file& file, const std::filesystem::path& path, std::span<const placed_scan> scans,
                  const points_extent& extent, int threads) {
  if (file.stream().tellp() < 0)
    throw file_error(path, "is no file that LAS and LAZ can be written to: their header comes last",
                     "Name a file, or write .ply");
  const las_layout layout = make_las_layout(path, scans, extent, threads);
  las_writer writer(file.stream(), layout, extension_of(path) == ".laz", threads);
  for_each_record(scans, layout.records, threads, [&](std::span<const char> records) {
    writer.write(records);
    file.require_good();
  });
  writer.finish();
}

}  // namespace

void require_scan_format(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  if (extension != ".ply" && extension != ".las" && extension != ".laz")
    throw file_error(path, "has no extension that names a format of scans", "Name it .ply, .las or .laz");
}

void write_scans(const std::filesystem::path& path, std::span<const placed_scan> scans, int threads) {
  require_scan_format(path);
  atomic_file file(path);
  points_extent all;
  for (const placed_scan& scan : scans) {
    const points_extent extent = extent_of(scan, threads);
    all.count += extent.count;
    all.min = all.min.cwiseMin(extent.min);
    all.max = all.max.cwiseMax(extent.max);
  }
  if (extension_of(path) == ".ply")
    write_as_ply(file, scans, all, threads);
  else
    write_as_las(file, path, scans, all, threads);
  file.commit();
}

}  // namespace globalmatch::support

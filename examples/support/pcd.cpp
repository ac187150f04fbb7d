// The PCD format of the Point Cloud Library: a text header that declares fields, then the points as text,
// binary, or binary sorted by field and compressed.
#include <array>
#include <bit>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "support/lzf.hpp"
#include "support/point_records.hpp"
#include "support/scalars.hpp"
#include "support/scan_formats.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

constexpr std::string_view export_pcd_again = "Export the scan again as PCD 0.7 with x, y and z";

struct pcd_header {
  std::vector<std::string> fields, sizes, types, counts;  ///< as many words each
  std::optional<std::uint64_t> width, height, points;
  std::string data;
};

// Where x, y and z are in a record.
struct pcd_layout {
  std::array<std::size_t, 3> columns = {};  ///< in a line of text
  std::array<std::size_t, 3> offsets = {};  ///< [bytes] in a binary record
  std::array<std::size_t, 3> strides = {};  ///< [bytes] from point to point where data are sorted by field
  std::array<scalar, 3> types = {};
  std::vector<record_field> fields = {};   ///< attributes in a binary record
  std::vector<std::size_t> field_columns;  ///< of each of them in a line of text
  /// [bytes] of the PCD field that each is part of: where it begins in a record, and its size.
  std::vector<std::pair<std::size_t, std::size_t>> field_places;
  std::size_t record_columns = 0;
  std::size_t record_size = 0;
};

std::vector<std::string> values_of(const std::vector<std::string_view>& words) {
  std::vector<std::string> values;
  for (std::size_t i = 1; i < words.size(); ++i) values.push_back(lower_case(words[i]));
  return values;
}

std::uint64_t require_count(const input_file& file, std::string_view word) {
  const auto count = to_count(word);
  if (!count) file.fail("has a PCD header with '" + std::string(word) + "' for a count", export_pcd_again);
  return *count;
}

pcd_header parse_pcd_header(input_file& file) {
  pcd_header header;
  while (const auto line = file.read_line()) {
    const std::vector<std::string_view> words = split(*line, ' ');
    if (words.size() < 2) continue;
    const std::string keyword = lower_case(words[0]);
    if (keyword == "fields" || keyword == "columns") header.fields = values_of(words);  // the latter in 0.5
    if (keyword == "size") header.sizes = values_of(words);
    if (keyword == "type") header.types = values_of(words);
    if (keyword == "count") header.counts = values_of(words);
    if (keyword == "width") header.width = require_count(file, words[1]);
    if (keyword == "height") header.height = require_count(file, words[1]);
    if (keyword == "points") header.points = require_count(file, words[1]);
    if (keyword == "data") {
      header.data = lower_case(words[1]);
      return header;
    }
  }
  file.fail("has a PCD header without its DATA line", "It is probably truncated: copy or export it again");
}

std::optional<scalar> scalar_of(std::string_view type, std::string_view size) {
  constexpr struct {
    std::string_view type, size;
    scalar value;
  } known[] = {{"i", "1", scalar::int8},   {"u", "1", scalar::uint8},  {"i", "2", scalar::int16},
               {"u", "2", scalar::uint16}, {"i", "4", scalar::int32},  {"u", "4", scalar::uint32},
               {"i", "8", scalar::int64},  {"u", "8", scalar::uint64}, {"f", "4", scalar::float32},
               {"f", "8", scalar::float64}};
  for (const auto& k : known)
    if (k.type == type && k.size == size) return k.value;
  return std::nullopt;
}

// Attributes of a field: one for each of its numbers, or the colours that the bytes of one number are.
void add_attributes(const std::string& name, scalar type, std::size_t count, bool is_text,
                    pcd_layout& layout) {
  constexpr std::size_t max_attributes = 4096;  // fields may announce any number of them
  if (name == "_" || layout.fields.size() + count > max_attributes) return;
  const bool is_color = (name == "rgb" || name == "rgba") && size_of(type) == 4 && count == 1 && !is_text;
  constexpr std::array<const char*, 4> colors = {"blue", "green", "red", "alpha"};
  for (std::size_t i = 0; i < (is_color ? name.size() : count); ++i) {
    attribute what{name, type};
    if (is_color) what = {colors[i], scalar::uint8};
    if (!is_color && count > 1) what.name += '[' + std::to_string(i) + ']';
    layout.fields.push_back({what, layout.record_size + i * size_of(what.type)});
    layout.field_columns.push_back(layout.record_columns + i);
    layout.field_places.emplace_back(layout.record_size, count * size_of(type));
  }
}

pcd_layout layout_of(const input_file& file, pcd_header header) {
  const std::size_t fields = header.fields.size();
  // Text is read without the sizes and types that early writers leave out.
  if (header.data == "ascii" && header.sizes.empty() && header.types.empty()) {
    header.sizes.assign(fields, "4");
    header.types.assign(fields, "f");
  }
  if (header.sizes.empty() || header.types.empty())
    file.fail("has a PCD header without SIZE or TYPE", export_pcd_again);
  if (header.sizes.size() != fields || header.types.size() != fields ||
      (!header.counts.empty() && header.counts.size() != fields))
    file.fail("has a PCD header whose FIELDS, SIZE, TYPE and COUNT differ in length", export_pcd_again);
  pcd_layout layout;
  std::array<int, 3> found = {};
  for (std::size_t f = 0; f < fields; ++f) {
    const auto type = scalar_of(header.types[f], header.sizes[f]);
    const std::uint64_t count = header.counts.empty() ? 1 : require_count(file, header.counts[f]);
    if (!type || count > std::numeric_limits<std::uint16_t>::max())
      file.fail("has the PCD field '" + header.fields[f] + "' of an unknown type or size", export_pcd_again);
    bool is_axis = false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (header.fields[f] != std::string(1, "xyz"[axis]) || count == 0) continue;
      is_axis = true;
      ++found[axis];
      layout.columns[axis] = layout.record_columns;
      layout.offsets[axis] = layout.record_size;
      layout.strides[axis] = size_of(*type) * count;
      layout.types[axis] = *type;
    }
    if (!is_axis) add_attributes(header.fields[f], *type, count, header.data == "ascii", layout);
    layout.record_columns += count;
    layout.record_size += size_of(*type) * count;
  }
  if (found != std::array{1, 1, 1})
    file.fail("has a PCD header without the single fields x, y and z", export_pcd_again);
  return layout;
}

// The number of points, which the header may give as rows and columns; the data have room for `room`.
std::size_t point_count(const input_file& file, const pcd_header& header, std::uint64_t room) {
  if (header.points) {
    if (*header.points > room) file.fail_truncated();
    return *header.points;
  }
  if (!header.width) file.fail("has a PCD header without POINTS and WIDTH", export_pcd_again);
  const std::uint64_t height = header.height.value_or(1);
  if (height > 0 && *header.width > room / height) file.fail_truncated();
  return *header.width * height;
}

void append_columns(std::string_view line, char separator, const pcd_layout& layout,
                    attribute_table& attributes) {
  const std::vector<std::string_view> cells = split(line, separator);
  for (std::size_t k = 0; k < layout.field_columns.size(); ++k) {
    const std::size_t column = layout.field_columns[k];
    const auto number = column < cells.size() ? to_number(cells[column]) : std::nullopt;
    attributes.append(k, number.value_or(std::numeric_limits<double>::quiet_NaN()));
  }
}

std::unique_ptr<point_source> read_ascii(input_file& file, const pcd_layout& layout, std::size_t count,
                                         const scan_options& options) {
  attribute_table attributes(options.attributes ? attributes_of(layout.fields) : std::vector<attribute>());
  std::vector<Eigen::Vector3d> points;
  points.reserve(count);
  char separator = ' ';
  while (points.size() < count) {
    const auto line = file.read_line();
    if (!line) file.fail_truncated();
    if (trim(*line).empty()) continue;
    if (points.empty()) separator = separator_of(*line);
    points.push_back(read_columns(file, *line, separator, layout.columns));
    if (!attributes.empty()) append_columns(*line, separator, layout, attributes);
  }
  return std::make_unique<points_in_memory>(std::move(points), std::move(attributes));
}

std::unique_ptr<point_source> open_binary(const input_file& file, const pcd_header& header,
                                          const pcd_layout& layout) {
  const std::size_t count = point_count(file, header, file.remaining() / layout.record_size);
  return std::make_unique<point_records>(
      file.bytes(), record_layout{file.offset(), count, layout.record_size, layout.offsets, layout.types,
                                  std::endian::little, layout.fields});
}

std::vector<char> unpack(input_file& file) {
  const std::size_t packed = load<std::uint32_t>(file.read(4), std::endian::little);
  const std::size_t unpacked = load<std::uint32_t>(file.read(4), std::endian::little);
  if (packed > file.remaining()) file.fail_truncated();
  const auto bytes = unpacked / lzf_max_growth > packed
                         ? std::nullopt
                         : lzf_decompress({file.read(packed), packed}, unpacked);
  if (!bytes) file.fail("holds damaged compressed data", "Copy or export the scan again");
  return *bytes;
}

// The numbers of a field are together, and its attributes in turn.
attribute_table read_sorted(std::span<const char> bytes, const pcd_layout& layout, std::size_t count) {
  attribute_table table(attributes_of(layout.fields));
  for (std::size_t k = 0; k < layout.fields.size(); ++k) {
    const scalar type = layout.fields[k].what.type;
    const auto [begin, stride] = layout.field_places[k];
    const char* column = bytes.data() + begin * count + (layout.fields[k].offset - begin);
    for (std::size_t i = 0; i < count; ++i)
      table.append(k, load(type, column + i * stride, std::endian::little));
  }
  return table;
}

std::unique_ptr<point_source> read_compressed(input_file& file, const pcd_header& header,
                                              const pcd_layout& layout, const scan_options& options) {
  const std::vector<char> bytes = unpack(file);
  const std::size_t count = point_count(file, header, bytes.size() / layout.record_size);
  std::vector<Eigen::Vector3d> points(count);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const char* column = bytes.data() + layout.offsets[axis] * count;
    for (std::size_t i = 0; i < count; ++i)
      points[i][static_cast<Eigen::Index>(axis)] =
          load(layout.types[axis], column + i * layout.strides[axis], std::endian::little);
  }
  return std::make_unique<points_in_memory>(
      std::move(points), options.attributes ? read_sorted(bytes, layout, count) : attribute_table());
}

std::unique_ptr<point_source> open_points(input_file& file, const pcd_header& header,
                                          const pcd_layout& layout, const scan_options& options) {
  if (header.data != "ascii") file.offset();  // throws where there can be no binary data
  if (header.data == "binary_compressed") return read_compressed(file, header, layout, options);
  if (header.data == "binary") return open_binary(file, header, layout);
  if (header.data != "ascii") file.fail("has the unknown PCD data '" + header.data + "'", export_pcd_again);
  // A line holds at least a digit and a blank for each column; the last one may lack its end.
  const std::uint64_t room = (file.remaining() + 1) / (2 * layout.record_columns);
  return read_ascii(file, layout, point_count(file, header, room), options);
}

}  // namespace

opened_scan open_pcd(input_file& file, const scan_options& options) {
  const pcd_header header = parse_pcd_header(file);
  const pcd_layout layout = layout_of(file, header);
  opened_scan scan{open_points(file, header, layout, options), {.format = "PCD, " + header.data}};
  if (header.data == "ascii"
          ? has_text_behind(file)
          : header.data == "binary" && file.remaining() / layout.record_size > scan.points->size())
    scan.header.notes.push_back(note_on_more_points(scan.points->size(), "further data"));
  for (const std::string& field : header.fields)
    if (field != "x" && field != "y" && field != "z" && field != "_") scan.header.attributes.push_back(field);
  return scan;
}

}  // namespace globalmatch::support

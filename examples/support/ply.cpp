// The PLY format: a header that declares elements and their properties, then their values as text or binary.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "support/point_records.hpp"
#include "support/scalars.hpp"
#include "support/scan_formats.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

struct ply_property {
  std::string name;
  scalar type;
  std::optional<scalar> count_type;  ///< of lists: the type of the number in front of the items
};

struct ply_element {
  std::string name;
  std::uint64_t count;
  std::vector<ply_property> properties;
};

struct ply_header {
  std::string format;
  std::vector<ply_element> elements;
};

constexpr std::string_view export_ply_again = "Export the scan again as PLY with x, y and z";

std::optional<scalar> scalar_named(std::string_view name) {
  constexpr std::pair<std::string_view, scalar> names[] = {
      {"char", scalar::int8},       {"int8", scalar::int8},       {"uchar", scalar::uint8},
      {"uint8", scalar::uint8},     {"short", scalar::int16},     {"int16", scalar::int16},
      {"ushort", scalar::uint16},   {"uint16", scalar::uint16},   {"int", scalar::int32},
      {"int32", scalar::int32},     {"uint", scalar::uint32},     {"uint32", scalar::uint32},
      {"float", scalar::float32},   {"float32", scalar::float32}, {"double", scalar::float64},
      {"float64", scalar::float64}, {"int64", scalar::int64},     {"uint64", scalar::uint64},
      {"long", scalar::int64},      {"ulong", scalar::uint64}};
  for (const auto& [known, type] : names)
    if (lower_case(name) == known) return type;
  return std::nullopt;
}

scalar require_scalar(const input_file& file, std::string_view name) {
  const auto type = scalar_named(name);
  if (!type)
    file.fail_at_line("names the unknown property type '" + std::string(name) + "'", export_ply_again);
  return *type;
}

ply_property parse_property(const input_file& file, const std::vector<std::string_view>& words) {
  if (words.size() == 3) return {std::string(words[2]), require_scalar(file, words[1]), std::nullopt};
  if (words.size() == 5 && words[1] == "list")
    return {std::string(words[4]), require_scalar(file, words[3]), require_scalar(file, words[2])};
  file.fail_at_line("declares a property in no known way", export_ply_again);
}

ply_element parse_element(const input_file& file, const std::vector<std::string_view>& words) {
  const auto count = words.size() == 3 ? to_count(words[2]) : std::nullopt;
  if (!count) file.fail_at_line("declares an element without a name and a count", export_ply_again);
  return {std::string(words[1]), *count, {}};
}

ply_header parse_ply_header(input_file& file) {
  ply_header header;
  while (const auto line = file.read_line()) {
    const std::vector<std::string_view> words = split(*line, ' ');
    const std::string keyword = words.empty() ? "comment" : lower_case(words[0]);
    if (keyword == "end_header") return header;
    if (keyword == "format" && words.size() > 1) {
      header.format = lower_case(words[1]);
    } else if (keyword == "element") {
      header.elements.push_back(parse_element(file, words));
    } else if (keyword == "property") {
      if (header.elements.empty())
        file.fail_at_line("declares a property before any element", export_ply_again);
      header.elements.back().properties.push_back(parse_property(file, words));
    } else if (keyword != "ply" && keyword != "comment" && keyword != "obj_info") {
      file.fail_at_line("is no line of a PLY header", export_ply_again);
    }
  }
  file.fail("has a PLY header without its end_header line",
            "It is probably truncated: copy or export it again");
}

// The values of a text file: one line for each record.
class ascii_values {
 public:
  explicit ascii_values(input_file& file) : file_(file) {}

  void begin_record() {
    if (is_one_line_ && field_) return;
    do {
      const auto line = file_.read_line();
      if (!line) file_.fail_truncated();
      fields_ = field_reader(*line, ' ');
      field_ = fields_.next();
    } while (!field_);
    // What follows the numbers of a record is ignored, unless nothing follows the line: it holds all records.
    is_one_line_ = !is_first_read_ && file_.remaining() == 0;
    is_first_read_ = true;
  }

  double next(scalar) {
    const auto value = field_ ? to_number(*field_) : std::nullopt;
    if (!value)
      file_.fail_at_line("has too few numbers with blanks between them, or something else among them",
                         export_ply_again);
    field_ = fields_.next();
    return *value;
  }

  void skip(scalar type, std::uint64_t count) {
    while (count-- > 0) next(type);
  }

  static std::uint64_t min_size(const ply_property&) { return 2; }  // a digit and a blank

 private:
  input_file& file_;
  field_reader fields_{"", ' '};
  std::optional<std::string_view> field_;
  bool is_first_read_ = false, is_one_line_ = false;
};

class binary_values {
 public:
  binary_values(input_file& file, std::endian order) : file_(file), order_(order) {}

  void begin_record() {}

  double next(scalar type) { return load(type, file_.read(size_of(type)), order_); }

  void skip(scalar type, std::uint64_t count) {
    if (count > file_.remaining() / size_of(type)) file_.fail_truncated();
    file_.skip(count * size_of(type));
  }

  static std::uint64_t min_size(const ply_property& p) { return size_of(p.count_type.value_or(p.type)); }

 private:
  input_file& file_;
  std::endian order_;
};

template <class Values>
void skip_list(const input_file& file, Values& values, const ply_property& property) {
  const double length = values.next(*property.count_type);
  if (!(length >= 0 && length <= 0x1p32))
    file.fail("has a list of impossible length '" + property.name + "'", export_ply_again);
  values.skip(property.type, static_cast<std::uint64_t>(length));
}

// Axis that a property holds, or -1.
int axis_of(const ply_property& property) {
  if (property.count_type) return -1;
  const std::string name = lower_case(property.name);
  if (name.empty() || name.size() > 2 || (name.size() == 2 && name[0] != 'p')) return -1;
  return name.back() >= 'x' && name.back() <= 'z' ? name.back() - 'x' : -1;
}

bool holds_points(const ply_element& element) {
  const std::string name = lower_case(element.name);
  return name == "vertex" || name == "vertices" || name == "point" || name == "points";
}

// Calls `use(point)` for each record of an element; the point is zero in elements without x, y and z.
// Attributes are appended to the table, which has one for each number that is no coordinate, or none at all.
template <class Values, class Use>
void read_records(const input_file& file, Values& values, const ply_element& element,
                  attribute_table& attributes, const Use& use) {
  std::vector<int> axes;
  for (const ply_property& property : element.properties) axes.push_back(axis_of(property));
  for (std::uint64_t i = 0; i < element.count; ++i) {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    std::size_t number = 0;
    values.begin_record();
    for (std::size_t k = 0; k < axes.size(); ++k) {
      const ply_property& property = element.properties[k];
      if (property.count_type)
        skip_list(file, values, property);
      else if (axes[k] >= 0)
        p[axes[k]] = values.next(property.type);
      else if (!attributes.empty())
        attributes.append(number++, values.next(property.type));
      else
        values.skip(property.type, 1);
    }
    use(p);
  }
}

template <class Values>
void require_room(const input_file& file, const ply_element& element) {
  std::uint64_t record = 0;
  for (const ply_property& property : element.properties) record += Values::min_size(property);
  const std::uint64_t room = file.remaining() + 1;  // the last line of a text may lack its end
  if (record > 0 && element.count > room / record) file.fail_truncated();
}

// Passes over the elements that come before the points, which it returns.
template <class Values>
const ply_element& find_points(const input_file& file, Values& values, const ply_header& header) {
  for (const ply_element& element : header.elements) {
    if (element.properties.empty()) continue;
    require_room<Values>(file, element);
    if (holds_points(element)) return element;
    attribute_table none;
    read_records(file, values, element, none, [](const Eigen::Vector3d&) {});
  }
  return header.elements.back();  // not reached: there are points with properties
}

std::vector<attribute> attributes_of(const ply_element& element) {
  std::vector<attribute> attributes;
  for (const ply_property& property : element.properties)
    if (!property.count_type && axis_of(property) < 0) attributes.push_back({property.name, property.type});
  return attributes;
}

template <class Values>
std::unique_ptr<point_source> read_points(const input_file& file, Values& values, const ply_element& element,
                                          const scan_options& options) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(element.count);
  attribute_table attributes(options.attributes ? attributes_of(element) : std::vector<attribute>());
  read_records(file, values, element, attributes, [&](const Eigen::Vector3d& p) { points.push_back(p); });
  return std::make_unique<points_in_memory>(std::move(points), std::move(attributes));
}

// Records with lists differ in length: they are read one after the other.
std::unique_ptr<point_source> open_binary(input_file& file, const ply_header& header, std::endian order,
                                          const scan_options& options) {
  binary_values values(file, order);
  const ply_element& element = find_points(file, values, header);
  record_layout layout{.begin = file.offset(), .count = element.count, .order = order};
  for (const ply_property& property : element.properties) {
    if (property.count_type) return read_points(file, values, element, options);
    if (const int axis = axis_of(property); axis >= 0) {
      layout.offsets[std::size_t(axis)] = layout.size;
      layout.types[std::size_t(axis)] = property.type;
    } else {
      layout.fields.push_back({{property.name, property.type}, layout.size});
    }
    layout.size += size_of(property.type);
  }
  return std::make_unique<point_records>(file.bytes(), std::move(layout));
}

std::unique_ptr<point_source> open_ascii(input_file& file, const ply_header& header,
                                         const scan_options& options) {
  ascii_values values(file);
  return read_points(file, values, find_points(file, values, header), options);
}

std::unique_ptr<point_source> open_points(input_file& file, const ply_header& header,
                                          const scan_options& options) {
  if (header.format == "ascii") return open_ascii(file, header, options);
  if (header.format == "binary_little_endian") return open_binary(file, header, std::endian::little, options);
  if (header.format == "binary_big_endian") return open_binary(file, header, std::endian::big, options);
  file.fail("has the unknown PLY format '" + header.format + "'", export_ply_again);
}

const ply_element& require_positions(const input_file& file, const ply_header& header) {
  const auto vertex = std::find_if(header.elements.begin(), header.elements.end(), holds_points);
  if (vertex == header.elements.end()) file.fail("has no element 'vertex'", export_ply_again);
  std::array<int, 3> found = {};
  for (const ply_property& property : vertex->properties)
    if (axis_of(property) >= 0) ++found[static_cast<std::size_t>(axis_of(property))];
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (found[axis] != 1)
      file.fail(std::string("has no single property '") + "xyz"[axis] + "' among those of its vertices",
                export_ply_again);
  return *vertex;
}

// Whether data follow the points, once they were opened, that no element announces.
bool has_more_points(input_file& file, const ply_header& header, const ply_element& vertex) {
  for (const ply_element& element : header.elements)
    if (&element > &vertex && element.count > 0) return false;
  if (header.format == "ascii") return has_text_behind(file);
  std::uint64_t record = 0;  // with empty lists
  bool has_lists = false;
  for (const ply_property& property : vertex.properties) {
    has_lists |= property.count_type.has_value();
    record += size_of(property.count_type.value_or(property.type));
  }
  return file.remaining() / record > (has_lists ? 0 : vertex.count);  // points with lists were read
}

}  // namespace

opened_scan open_ply(input_file& file, const scan_options& options) {
  const ply_header header = parse_ply_header(file);
  const ply_element& vertex = require_positions(file, header);
  opened_scan scan{open_points(file, header, options), {.format = "PLY, " + header.format}};
  if (has_more_points(file, header, vertex))
    scan.header.notes.push_back(note_on_more_points(vertex.count, "further data"));
  for (const ply_property& property : vertex.properties)
    if (axis_of(property) < 0) scan.header.attributes.push_back(property.name);
  return scan;
}

}  // namespace globalmatch::support

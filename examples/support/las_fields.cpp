#include "support/las_fields.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <utility>

#include "support/scalars.hpp"

namespace globalmatch::support {

namespace {

constexpr std::size_t at_type = 2, at_options = 3, at_name = 4, at_scale = 112, at_offset = 136;
constexpr std::size_t name_size = 32;
constexpr unsigned has_scale = 8, has_offset = 16;  // of the options

// In the order of their numbers, from 1 on.
constexpr scalar extra_types[] = {scalar::uint8,   scalar::int8,   scalar::uint16, scalar::int16,
                                  scalar::uint32,  scalar::int32,  scalar::uint64, scalar::int64,
                                  scalar::float32, scalar::float64};
constexpr unsigned number_of_types = 10;

std::vector<record_field> fields_of_short_records() {
  return {{{"intensity", scalar::uint16}, 12},
          {{"return_number", scalar::uint8}, 14, 0, 3},
          {{"number_of_returns", scalar::uint8}, 14, 3, 3},
          {{"scan_direction_flag", scalar::uint8}, 14, 6, 1},
          {{"edge_of_flight_line", scalar::uint8}, 14, 7, 1},
          {{"classification", scalar::uint8}, 15, 0, 5},
          {{"synthetic", scalar::uint8}, 15, 5, 1},
          {{"key_point", scalar::uint8}, 15, 6, 1},
          {{"withheld", scalar::uint8}, 15, 7, 1},
          {{"scan_angle", scalar::int8}, 16},
          {{"user_data", scalar::uint8}, 17},
          {{"point_source_id", scalar::uint16}, 18}};
}

std::vector<record_field> fields_of_long_records() {
  constexpr double unit_of_angles = 0.006;  // [degrees]
  return {{{"intensity", scalar::uint16}, 12},
          {{"return_number", scalar::uint8}, 14, 0, 4},
          {{"number_of_returns", scalar::uint8}, 14, 4, 4},
          {{"synthetic", scalar::uint8}, 15, 0, 1},
          {{"key_point", scalar::uint8}, 15, 1, 1},
          {{"withheld", scalar::uint8}, 15, 2, 1},
          {{"overlap", scalar::uint8}, 15, 3, 1},
          {{"scanner_channel", scalar::uint8}, 15, 4, 2},
          {{"scan_direction_flag", scalar::uint8}, 15, 6, 1},
          {{"edge_of_flight_line", scalar::uint8}, 15, 7, 1},
          {{"classification", scalar::uint8}, 16},
          {{"user_data", scalar::uint8}, 17},
          {{"scan_angle", scalar::int16, unit_of_angles}, 18},
          {{"point_source_id", scalar::uint16}, 20},
          {{"gps_time", scalar::float64}, 22}};
}

// Attributes of one description: a number, some, or some bytes.
void add_fields(std::string_view description, std::size_t begin, std::vector<record_field>& fields) {
  const unsigned type = number_at<std::uint8_t>(description, at_type),
                 options = number_at<std::uint8_t>(description, at_options);
  const std::string_view padded = description.substr(at_name, name_size);
  const std::string name(padded.substr(0, padded.find('\0')));
  const bool is_known = type > 0 && type <= 3 * number_of_types;
  const std::size_t count = is_known ? 1 + (type - 1) / number_of_types : options;
  for (std::size_t i = 0; i < count; ++i) {
    attribute what{name, is_known ? extra_types[(type - 1) % number_of_types] : scalar::uint8};
    if (is_known && options & has_scale) what.scale = number_at<double>(description, at_scale + 8 * i);
    if (is_known && options & has_offset) what.offset = number_at<double>(description, at_offset + 8 * i);
    if (what.scale == 0) what.scale = 1;
    if (count > 1) what.name += '[' + std::to_string(i) + ']';
    fields.push_back({what, begin + i * size_of(what.type)});
  }
}

std::size_t end_of(const record_field& field) {
  return field.offset + size_of(field.what.type);
}

}  // namespace

std::vector<record_field> las_fields(unsigned format) {
  if (format > 10) return {};
  std::vector<record_field> fields = format < 6 ? fields_of_short_records() : fields_of_long_records();
  std::size_t end = format < 6 ? 20 : 30;
  const auto add = [&](const char* name, scalar type) {
    fields.push_back({{name, type}, end});
    end += size_of(type);
  };
  if (format == 1 || (format >= 3 && format <= 5)) add("gps_time", scalar::float64);
  if (format == 2 || format == 3 || format == 5 || format == 7 || format == 8 || format == 10)
    for (const char* name : {"red", "green", "blue"}) add(name, scalar::uint16);
  if (format == 8 || format == 10) add("near_infrared", scalar::uint16);
  return fields;
}

std::vector<record_field> extra_fields(std::string_view description, std::size_t begin,
                                       std::size_t record_size) {
  std::vector<record_field> fields;
  for (; description.size() >= extra_description_size && begin < record_size;
       description.remove_prefix(extra_description_size)) {
    add_fields(description, begin, fields);
    if (!fields.empty()) begin = std::max(begin, end_of(fields.back()));
  }
  while (!fields.empty() && end_of(fields.back()) > record_size) fields.pop_back();
  if (!fields.empty()) begin = end_of(fields.back());
  for (std::size_t i = 0; begin + i < record_size; ++i)
    fields.push_back({{"extra_bytes[" + std::to_string(i) + ']', scalar::uint8}, begin + i});
  return fields;
}

std::string describe_extra_fields(const std::vector<record_field>& fields) {
  std::string bytes(fields.size() * extra_description_size, '\0');
  char* start = bytes.data();
  for (const auto& [what, offset, first_bit, bits] : fields) {
    const auto type = std::find(std::begin(extra_types), std::end(extra_types), what.type);
    start[at_type] = static_cast<char>(1 + (type - std::begin(extra_types)));
    start[at_options] = what.scale != 1 || what.offset != 0 ? char(has_scale | has_offset) : '\0';
    what.name.copy(start + at_name, name_size);
    if (start[at_options] != 0)
      for (const auto& [value, offset_of_value] :
           {std::pair(what.scale, at_scale), {what.offset, at_offset}}) {
        std::memcpy(start + offset_of_value, &value, sizeof(value));
        if (std::endian::native == std::endian::big)
          std::reverse(start + offset_of_value, start + offset_of_value + sizeof(value));
      }
    start += extra_description_size;
  }
  return bytes;
}

}  // namespace globalmatch::support

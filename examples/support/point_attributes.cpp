#include "support/point_attributes.hpp"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <limits>
#include <utility>

namespace globalmatch::support {

namespace {

// Lower case letters and digits alone, without what CloudCompare puts before the names of scalar fields.
std::string letters_of(std::string_view name) {
  std::string letters;
  for (const char c : name)
    if (std::isalnum(static_cast<unsigned char>(c)))
      letters += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const std::string_view prefix : {"scalarfield", "scalar"})
    if (letters.starts_with(prefix) && letters.size() > prefix.size()) return letters.substr(prefix.size());
  return letters;
}

// What PDAL, CloudCompare, LAStools, lidR, laspy, E57 and scanners' programs call the attributes of LAS.
constexpr std::pair<std::string_view, std::string_view> known_names[] = {
    {"intensity", "intensity"},
    {"intensities", "intensity"},
    {"returnnumber", "return_number"},
    {"numberofreturns", "number_of_returns"},
    {"returncount", "number_of_returns"},
    {"scandirectionflag", "scan_direction_flag"},
    {"edgeofflightline", "edge_of_flight_line"},
    {"edgeofflightlineflag", "edge_of_flight_line"},
    {"classification", "classification"},
    {"class", "classification"},
    {"synthetic", "synthetic"},
    {"syntheticflag", "synthetic"},
    {"keypoint", "key_point"},
    {"keypointflag", "key_point"},
    {"withheld", "withheld"},
    {"withheldflag", "withheld"},
    {"overlap", "overlap"},
    {"overlapflag", "overlap"},
    {"scannerchannel", "scanner_channel"},
    {"scanchannel", "scanner_channel"},
    {"scanangle", "scan_angle"},
    {"scananglerank", "scan_angle"},
    {"userdata", "user_data"},
    {"pointsourceid", "point_source_id"},
    {"ptsrcid", "point_source_id"},
    {"gpstime", "gps_time"},
    {"red", "red"},
    {"r", "red"},
    {"colorred", "red"},
    {"diffusered", "red"},
    {"green", "green"},
    {"g", "green"},
    {"colorgreen", "green"},
    {"diffusegreen", "green"},
    {"blue", "blue"},
    {"b", "blue"},
    {"colorblue", "blue"},
    {"diffuseblue", "blue"},
    {"nearinfrared", "near_infrared"},
    {"infrared", "near_infrared"},
    {"nir", "near_infrared"},
};

template <class T, class U>
constexpr bool holds(T, U) {
  using of_t = std::numeric_limits<T>;
  using of_u = std::numeric_limits<U>;
  const bool has_sign = of_t::is_signed || !of_u::is_signed;
  return has_sign && of_t::digits >= of_u::digits && (!of_t::is_integer || of_u::is_integer);
}

}  // namespace

attribute_table attribute_table::of_names(const std::vector<std::string>& names) {
  std::vector<attribute> attributes;
  for (const std::string& name : names) attributes.push_back({name});
  return attribute_table(std::move(attributes));
}

void attribute_table::append(std::size_t attribute, double number) {
  visit_type(attributes_[attribute].type, [&]<class T>(T) {
    const T stored = nearest<T>(number);
    const auto* bytes = reinterpret_cast<const char*>(&stored);
    numbers_[attribute].insert(numbers_[attribute].end(), bytes, bytes + sizeof(T));
  });
}

void attribute_table::read(std::size_t first, std::size_t count, std::span<attribute_column> columns) const {
  for (attribute_column& column : columns) {
    const std::size_t size = size_of(attributes_[column.attribute].type);
    const auto begin = numbers_[column.attribute].begin() + static_cast<std::ptrdiff_t>(first * size);
    column.numbers.assign(begin, begin + static_cast<std::ptrdiff_t>(count * size));
  }
}

std::string common_name(std::string_view name) {
  const std::string letters = letters_of(name);
  const auto known = std::find_if(std::begin(known_names), std::end(known_names),
                                  [&](const auto& pair) { return pair.first == letters; });
  if (known != std::end(known_names)) return std::string(known->second);
  std::string plain(name);
  for (char& c : plain)
    if (std::isspace(static_cast<unsigned char>(c)) || std::iscntrl(static_cast<unsigned char>(c))) c = '_';
  return plain.empty() ? "unnamed" : plain;
}

bool holds_all_of(scalar type, scalar other) {
  return visit_type(type, [&](auto t) { return visit_type(other, [&](auto u) { return holds(t, u); }); });
}

}  // namespace globalmatch::support

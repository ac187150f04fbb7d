#include "support/text_fields.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <limits>
#include <system_error>

namespace globalmatch::support {

namespace {
constexpr std::string_view blanks = " \t\r\n";

/// The number that all of a text is.
std::optional<double> parsed(const std::string& text) {
#if defined(__cpp_lib_to_chars)
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stop != end) return std::nullopt;
#else  // libc++ reads no fractions so; `strtod` takes blanks, signs and hexadecimal numbers, too
  constexpr std::string_view others = " \t\r\n\v\f+";
  if (text.empty() || others.find(text.front()) != std::string_view::npos) return std::nullopt;
  if (text.find_first_of("xX") != std::string::npos) return std::nullopt;
  char* stop = nullptr;
  errno = 0;
  const double value = std::strtod(text.c_str(), &stop);
  if (errno == ERANGE || stop != text.c_str() + text.size()) return std::nullopt;
#endif
  return value;
}

// Removes what separates groups of three digits; false where they are none, or where one group alone might be
// the decimals.
bool remove_groups(std::string& digits, char group, char point) {
  const std::size_t first = digits.find_first_of("0123456789"),
                    end = std::min(digits.find(point), digits.size());
  if (first == std::string::npos || digits[first] == '0') return false;
  std::size_t groups = 0, length = 0;
  for (std::size_t i = first; i < end; ++i) {
    const bool is_digit = digits[i] >= '0' && digits[i] <= '9';
    if (!is_digit && digits[i] != group) return false;
    if (is_digit && ++length > 3) return false;
    if (is_digit) continue;
    if (groups == 0 ? length == 0 : length != 3) return false;
    ++groups;
    length = 0;
  }
  if (groups == 0 || length != 3 || (groups == 1 && end == digits.size())) return false;
  if (digits.find(group, end) != std::string::npos) return false;
  std::erase(digits, group);
  return true;
}

}  // namespace

std::string_view trim(std::string_view text) {
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::string quoted(std::string_view text) {
  constexpr std::size_t enough = 100;
  std::string start(text.substr(0, enough));
  for (char& c : start)
    if (c >= 0 && c < ' ') c = ' ';
  return "'" + start + (text.size() > enough ? "...'" : "'");
}

std::string lower_case(std::string_view text) {
  std::string small(text);
  for (char& c : small)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return small;
}

std::optional<double> to_number(std::string_view field) {
  if (field.starts_with('+')) field.remove_prefix(1);
  return parsed(std::string(field));
}

std::optional<double> to_number(std::string_view field, bool decimal_comma) {
  if (field.find(".#") != std::string_view::npos) return std::numeric_limits<double>::quiet_NaN();
  const char point = decimal_comma ? ',' : '.', group = decimal_comma ? '.' : ',';
  const bool has_groups = field.find(group) != std::string_view::npos;
  if (!has_groups && !decimal_comma) return to_number(field);
  std::string digits(field);
  if (has_groups && !remove_groups(digits, group, point)) return std::nullopt;
  std::replace(digits.begin(), digits.end(), point, '.');
  return to_number(digits);
}

std::optional<std::uint64_t> to_count(std::string_view field) {
  std::uint64_t count = 0;
  const char* end = field.data() + field.size();
  const auto [stop, error] = std::from_chars(field.data(), end, count);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return count;
}

char separator_of(std::string_view line) {
  for (const char separator : {';', ','})
    if (line.find(separator) != std::string_view::npos) return separator;
  return ' ';
}

field_reader::field_reader(std::string_view line, char separator)
    : rest_(line), separator_(separator), at_end_(trim(line).empty()) {
  // Tabs at the ends of a line are empty fields where they separate.
  if (separator == '\t')
    while (rest_.ends_with('\r') || rest_.ends_with('\n')) rest_.remove_suffix(1);
  else
    rest_ = trim(rest_);
}

std::optional<std::string_view> field_reader::next() {
  if (at_end_) return std::nullopt;
  std::size_t search_from = 0;
  if (rest_.starts_with('"')) {
    // A separator between quotes does not separate; a doubled quote opens the next quoted stretch.
    bool quoted = false;
    while (search_from < rest_.size() && (quoted || rest_[search_from] != separator_))
      quoted ^= rest_[search_from++] == '"';
  }
  const std::size_t end =
      separator_ == ' ' ? rest_.find_first_of(" \t", search_from) : rest_.find(separator_, search_from);
  std::string_view field = trim(rest_.substr(0, end));
  for (const char quote : {'"', '\''})
    if (field.size() >= 2 && field.starts_with(quote) && field.ends_with(quote)) {
      field = trim(field.substr(1, field.size() - 2));
      break;
    }
  at_end_ = end == std::string_view::npos;
  rest_ = at_end_ ? std::string_view{} : rest_.substr(end + 1);
  if (separator_ == ' ') rest_ = trim(rest_);
  return field;
}

std::size_t field_reader::count_left() const {
  if (at_end_) return 0;
  if (rest_.find('"') != std::string_view::npos) {
    std::size_t count = 0;
    for (field_reader left = *this; left.next();) ++count;
    return count;
  }
  if (separator_ != ' ') return 1 + std::size_t(std::count(rest_.begin(), rest_.end(), separator_));
  std::size_t count = 0;
  bool within = false;
  for (const char c : rest_) {
    const bool is_part = c != ' ' && c != '\t';
    count += is_part && !within;
    within = is_part;
  }
  return count;
}

std::vector<std::string_view> split(std::string_view line, char separator) {
  std::vector<std::string_view> all;
  field_reader fields(line, separator);
  while (const auto field = fields.next()) all.push_back(*field);
  return all;
}

bool has_text_behind(input_file& file) {
  while (const auto line = file.read_line())
    if (!trim(*line).empty()) return true;
  return false;
}

std::vector<std::string> names_behind_xyz(std::size_t columns) {
  if (columns == 4) return {"intensity"};
  if (columns == 6) return {"red", "green", "blue"};
  if (columns == 7) return {"intensity", "red", "green", "blue"};
  std::vector<std::string> names;
  for (std::size_t column = 4; column <= columns; ++column)
    names.push_back("column_" + std::to_string(column));
  return names;
}

Eigen::Vector3d read_columns(const input_file& file, std::string_view line, char separator,
                             const std::array<std::size_t, 3>& columns) {
  Eigen::Vector3d p;
  field_reader fields(line, separator);
  const std::size_t last = *std::max_element(columns.begin(), columns.end());
  for (std::size_t column = 0; column <= last; ++column) {
    const auto field = fields.next();
    if (!field)
      file.fail_at_line("has only " + std::to_string(column) + " fields, but x, y and z are needed",
                        "Mend or remove that line");
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (columns[axis] != column) continue;
      const auto value = to_number(*field);
      if (!value)
        file.fail_at_line("has '" + std::string(field->substr(0, 40)) + "' where a number is expected",
                          "Numbers are written like 12.5 or -1.25e1, with a decimal point");
      p[static_cast<Eigen::Index>(axis)] = *value;
    }
  }
  return p;
}

}  // namespace globalmatch::support

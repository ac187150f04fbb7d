#include "support/table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "support/commented_names.hpp"

namespace globalmatch::support {

namespace {

constexpr std::size_t all_cells = std::size_t(-1);
constexpr std::size_t looked_at = 200;  // lines, for what stands above the rows and how they are cut
constexpr std::array<char, 5> separators = {'\t', ';', ',', '|', ' '};

// The text of a comment; empty when the line is none.
std::optional<std::string_view> comment_of(std::string_view line) {
  for (const std::string_view sign : {"#", "//", "%", "!"})
    if (line.starts_with(sign)) return trim(line.substr(sign.size()));
  return std::nullopt;
}

// Whether a line has neither numbers nor words, as the rows below a table that Excel wrote.
bool is_blank(std::string_view line) {
  return line.find_first_not_of(" \t\r,;|\"'") == std::string_view::npos;
}

// Of the ways to cut a line that with most numbers has so many.
std::size_t count_numbers(std::string_view line) {
  std::size_t most = 0;
  for (const char separator : separators)
    for (const bool decimal_comma : {false, true}) {
      std::size_t count = 0;
      for (const std::string_view cell : split(line, separator))
        count += to_number(cell, decimal_comma).has_value();
      most = std::max(most, count);
    }
  return most;
}

bool is_integer(std::string_view cell) {
  return to_count(cell.starts_with('-') ? cell.substr(1) : cell).has_value();
}

std::string_view remedy_of(table_of kind) {
  return kind == table_of::stems ? "Name the columns above the rows, e.g.: x,y,z,radius"
                                 : "A text scan has a point a line, x y z first or named by a header; other "
                                   "known formats are PLY, PCD, LAS, LAZ, E57 and PTX";
}

}  // namespace

bool is_unknown_number(double number) {
  constexpr double numbers[] = {-9999, -99999, -999999, -32768, -2147483648.};
  constexpr double no_length = 1e30;  // the largest floats and doubles stand for none, too
  return std::isnan(number) || (std::isfinite(number) && std::abs(number) >= no_length) ||
         std::find(std::begin(numbers), std::end(numbers), number) != std::end(numbers);
}

table_reader::table_reader(input_file& file, table_of kind) : file_(file), kind_(kind), blocks_(file) {
  for (std::size_t rows = 0; rows < looked_at;) {
    const auto line = file.read_line();
    if (!line) break;
    ahead_.push_back({std::string(*line), file.line_number()});
    rows += !is_no_row(*line);
  }
  read_header();
  find_format();
  if (kind_ == table_of::points) needed_cells_ = std::max({*columns_.x, *columns_.y, *columns_.z}) + 1;
}

bool table_reader::is_count(std::string_view line) const {
  return kind_ == table_of::points && to_count(trim(line));
}

void table_reader::read_header() {
  std::optional<numbered_line> first, not_understood;
  while (!ahead_.empty()) {
    const numbered_line at = ahead_.front();
    const std::string_view line = trim(at.text);
    if (line.size() == 5 && lower_case(line).starts_with("sep=")) {
      given_separator_ = line[4];
    } else if (is_comment(at.text)) {
      line_number_ = at.number;
      if (names_.empty()) take_comment(*comment_of(line));
    } else if (is_count(line)) {
      blocks_.begin(*to_count(line));
    } else if (!line.empty()) {
      line_number_ = at.number;
      if (has_header() || count_numbers(at.text) > 1) break;
      if (take_header(at.text, {})) {
        ahead_.pop_front();
        take_next_header();
        take_units();
        continue;
      }
      if (!first) first = at;
      not_understood = at;
    }
    ahead_.pop_front();
  }
  if (has_header()) return;
  if (ahead_.empty()) not_understood = first;  // rows that are not cut are no headers
  if (!doubtful_comment_.empty())
    file_.fail("has a comment that may name the columns, but not those of its rows: " +
                   quoted(trim(doubtful_comment_)),
               remedy_of(kind_));
  const std::size_t cells = ahead_.empty() ? 0 : split(ahead_.front().text, ' ').size();
  const bool is_title =
      not_understood && !ahead_.empty() && kind_ == table_of::points &&
      split(not_understood->text, ' ').size() < std::min<std::size_t>(cells, 3) &&
      count_numbers(not_understood->text) == 0 && split(not_understood->text, ',').size() == 1 &&
      split(not_understood->text, ';').size() == 1 && split(not_understood->text, '\t').size() == 1;
  if (not_understood && !is_title)
    file_.fail("line " + std::to_string(not_understood->number) +
                   " names no columns that are known to be x and y" +
                   (kind_ == table_of::points ? " and z" : "") + ": " + quoted(trim(not_understood->text)),
               remedy_of(kind_));
  if (kind_ == table_of::stems) {
    if (ahead_.empty()) file_.fail("is empty", remedy_of(kind_));
    file_.fail("has no line that names the columns above the rows: " + quoted(trim(ahead_.front().text)),
               remedy_of(kind_));
  }
}

// A comment names the columns if it has a name for each cell of the row below. One that names coordinates
// and has not is an error, unless a header follows.
void table_reader::take_comment(std::string_view comment) {
  const auto row = std::find_if(ahead_.begin() + 1, ahead_.end(),
                                [&](const numbered_line& l) { return !is_no_row(l.text); });
  if (row == ahead_.end() || count_numbers(row->text) == 0) return;
  const auto has_cells = [&](std::size_t count) {
    return std::any_of(separators.begin(), separators.end(), [&](char separator) {
      std::vector<std::string_view> cells = split(row->text, separator);
      while (!cells.empty() && cells.back().empty()) cells.pop_back();
      return cells.size() == count;
    });
  };
  for (const std::string_view text : {announced_names(comment), comment}) {
    if (count_numbers(text) > 0) continue;  // it says where something is
    if (take_header(text, has_cells)) return;
    if (!is_doubtful(with_joined_units(text), has_cells)) continue;
    doubtful_comment_ = comment;
    return;
  }
}

// Whether a comment that does not fit the rows names coordinates nevertheless.
bool table_reader::is_doubtful(std::string_view comment, const cell_check& has_cells) const {
  for (const char separator : separators) {
    std::vector<std::string_view> names = split(comment, separator);
    while (!names.empty() && names.back().empty()) names.pop_back();
    if (names.size() < 2 || (separator == ' ' && is_prose(names))) continue;
    std::string ignored;
    const known_columns columns = find_columns(names, kind_, ignored);
    if (has_cells(names.size()) && names_other_coordinates(names)) return true;
    if (!columns.x || !columns.y || !columns.z) continue;
    const std::size_t cells = has_cells(3) ? 3 : 4;
    if (separator != ' ' || !is_harmless_sentence(names, *columns.x, *columns.y, *columns.z, cells))
      return true;
  }
  return false;
}

// Whether a line names the columns: x and y, of scans z, too, and as many as the rows have cells.
bool table_reader::take_header(std::string_view header, const cell_check& has_cells) {
  const std::string line = with_joined_units(header);
  for (const char separator : separators) {
    if (given_separator_ && separator != *given_separator_ && !has_cells) continue;
    std::vector<std::string_view> names = split(line, separator);
    while (!names.empty() && names.back().empty()) names.pop_back();
    if (names.size() < 2) continue;
    std::string problem;
    const known_columns columns = find_columns(names, kind_, problem);
    if (!columns.x || !columns.y || (kind_ == table_of::points && !columns.z)) continue;
    if (has_cells && !has_cells(names.size())) continue;
    if (!problem.empty())
      file_.fail("line " + std::to_string(line_number_) + " " + problem + ": " + quoted(trim(header)),
                 "Name one column each x, y and z, in a projected or local frame in metres");
    names_.assign(names.begin(), names.end());
    is_open_ended_ = split(line, separator).size() > names.size();
    columns_ = columns;
    header_separator_ = separator;
    return true;
  }
  return false;
}

// A header below what was taken for one, which is a title then.
void table_reader::take_next_header() {
  while (!ahead_.empty() && count_numbers(ahead_.front().text) == 0) {
    line_number_ = ahead_.front().number;
    if (!take_header(ahead_.front().text, {})) return;
    ahead_.pop_front();
  }
}

// A row of units below the header, such as m,m,m,cm.
void table_reader::take_units() {
  if (ahead_.empty()) return;
  const std::vector<std::string_view> cells = split(ahead_.front().text, header_separator_);
  if (cells.size() != names_.size() || count_numbers(ahead_.front().text) > 0 ||
      is_blank(ahead_.front().text))
    return;
  std::vector<double> units = columns_.units;
  for (const auto& column : {columns_.x, columns_.y, columns_.z, columns_.radius, columns_.diameter}) {
    if (!column) continue;
    const column_meaning named = meaning_of("x " + std::string(cells[*column]));
    if (!named.unit) return;
    units[*column] = *named.unit;
  }
  columns_.units = units;
  ahead_.pop_front();
}

std::size_t table_reader::cut(std::string_view line, char separator, std::size_t row_names,
                              std::vector<std::string_view>& cells, std::size_t max_cells) {
  cells.clear();
  field_reader fields(line, separator);
  for (std::size_t i = 0; i < row_names; ++i) fields.next();
  while (cells.size() < max_cells) {
    const auto cell = fields.next();
    if (!cell) break;
    cells.push_back(*cell);
  }
  return cells.size() + fields.count_left();
}

// Whether a line is a comment. One with a cell for each name, and numbers at x and y, is a row: `#12` may
// well be the tag of a tree. With a blank behind the sign, a row was made a comment.
bool table_reader::is_comment(std::string_view line) const {
  const auto comment = comment_of(trim(line));
  if (!comment) return false;
  if (!has_header()) return true;
  const char before = *(comment->data() - 1);
  if (comment->empty() || before == ' ' || before == '\t') return true;
  const std::vector<std::string_view> cells = split(line, header_separator_);
  const auto is_number = [&](std::size_t column) {
    return to_number(cells[column], false) || to_number(cells[column], true);
  };
  return cells.size() != names_.size() || !is_number(*columns_.x) || !is_number(*columns_.y);
}

// Tags of trees begin with a sign in all rows or in none: one of a kind may be a row that was left out.
void table_reader::require_same_sign(std::string_view line) {
  const bool has_sign = comment_of(trim(line)).has_value();
  if (rows_have_sign_.value_or(has_sign) != has_sign)
    fail_at_row(has_sign ? "may be a row or a comment" : "has no sign in front, unlike the rows before",
                "Begin no row with a sign of comments, or every one; put a blank behind that of a comment");
  rows_have_sign_ = has_sign;
}

// Whether a line is passed over: blank, a comment, or a count.
bool table_reader::is_no_row(std::string_view line) const {
  return is_blank(line) || is_comment(line) || is_count(line);
}

// Whether most of the first rows have a cell for each name, and numbers where x, y and z are.
bool table_reader::fits(char separator, bool decimal_comma, std::size_t row_names) const {
  std::size_t rows = 0, fitting = 0;
  std::vector<std::string_view> cells;
  for (const numbered_line& line : ahead_) {
    if (is_no_row(line.text)) continue;
    cut(line.text, separator, row_names, cells, all_cells);
    ++rows;
    const std::size_t named = has_header() ? names_.size() : 3;
    const auto rest = cells.begin() + std::ptrdiff_t(std::min(named, cells.size()));
    const bool extra = std::any_of(rest, cells.end(), [](std::string_view cell) { return !cell.empty(); });
    const bool enough =
        cells.size() >= named || (separator == '\t' && cells.size() > std::max(*columns_.x, *columns_.y));
    if (!enough || (has_header() && !is_open_ended_ && extra)) continue;
    const auto is_number = [&](std::size_t c) {
      return c < cells.size() && to_number(cells[c], decimal_comma);
    };
    const auto needs_comma = [&](const std::optional<std::size_t>& c) {
      return c && !is_number(*c) && *c < cells.size() && to_number(cells[*c], true);
    };
    const bool may_need_comma = !decimal_comma && line.text.find('.') == line.text.npos;
    if (may_need_comma &&
        (needs_comma(columns_.z) || needs_comma(columns_.radius) || needs_comma(columns_.diameter)))
      continue;
    const bool z_fits = !columns_.z || kind_ == table_of::stems || is_number(*columns_.z);
    fitting += is_number(*columns_.x) && is_number(*columns_.y) && z_fits;
  }
  return 2 * fitting > rows;
}

// Whether cells between commas are in quotes and have decimal commas: "10,25", but not "1,250" alone, which
// may be a thousand and more.
bool table_reader::has_quoted_decimals() const {
  bool is_clear = false;
  for (const numbered_line& line : ahead_) {
    if (is_no_row(line.text)) continue;
    for (const std::string_view cell : split(line.text, ',')) {
      const std::size_t comma = cell.rfind(',');
      if (!to_number(cell, true)) continue;
      if (cell.find('.') != cell.npos) return false;
      constexpr std::size_t thousand = 3;  // digits
      is_clear = is_clear || (comma != cell.npos && cell.size() - comma - 1 != thousand);
    }
  }
  return is_clear;
}

// Whether rows may have names before their cells that are not in quotes: between commas, not where a name of
// the header is that of the identifier, for a decimal comma makes one more cell, too.
bool table_reader::may_have_row_names(char separator) const {
  constexpr std::array<std::string_view, 8> identifiers = {"id", "fid",    "tag", "tree",
                                                           "nr", "treeid", "no",  "tree_id"};
  return has_header() && separator == header_separator_ &&
         (separator != ',' ||
          std::find(identifiers.begin(), identifiers.end(), lower_case(names_[0])) == identifiers.end());
}

// Whether the first cells are 0, 1, 2, ... or 1, 2, 3, ...
bool table_reader::counts_rows(const std::vector<std::string_view>& first_cells) const {
  if (first_cells.size() < 2) return false;
  const auto first = to_count(first_cells[0]);
  if (!first || *first > 1) return false;
  for (std::size_t i = 0; i < first_cells.size(); ++i)
    if (to_count(first_cells[i]) != *first + i) return false;
  return true;
}

// Whether the first cells are integers that increase, as identifiers of points, or too large for coordinates,
// as seconds of GPS: without a header there is no telling them from x. An x without decimals is usual where
// z or the intensity has none; identifiers have three columns with decimals behind them, or have no gaps.
bool table_reader::starts_with_no_coordinate(char separator, bool decimal_comma) const {
  constexpr std::size_t few = 3;
  constexpr double largest = 1e8;  // [m] beyond all projected coordinates
  std::size_t rows = 0;
  bool increases = true, has_no_gaps = true, is_large = true;
  std::array<bool, 4> has_decimals = {};
  std::optional<std::uint64_t> last;
  for (const numbered_line& line : ahead_) {
    if (is_no_row(line.text)) continue;
    const std::vector<std::string_view> cells = split(line.text, separator);
    if (cells.size() < 4) return false;
    const auto count = to_count(cells[0]);
    increases = increases && count && (!last || *count > *last);
    has_no_gaps = has_no_gaps && count && (!last || *count == *last + 1);
    is_large = is_large && to_number(cells[0], decimal_comma).value_or(0) > largest;
    for (std::size_t c = 1; c < 4; ++c) has_decimals[c] = has_decimals[c] || !is_integer(cells[c]);
    last = count;
    ++rows;
  }
  const bool are_identifiers =
      increases && has_decimals[1] && (has_no_gaps || (has_decimals[2] && has_decimals[3]));
  return rows >= few && (are_identifiers || is_large);
}

// Whether commas separate cells and decimals alike, as in 10,125,100,250,-5,500: every second cell of
// integers has as many digits as all of them.
bool table_reader::has_commas_of_two_kinds() const {
  constexpr std::size_t few = 3, coordinates = 6;
  std::size_t rows = 0, digits = 0;
  for (const numbered_line& line : ahead_) {
    if (is_no_row(line.text)) continue;
    const std::vector<std::string_view> cells = split(line.text, ',');
    if (cells.size() < coordinates || cells.size() % 2 != 0) return false;
    if (!std::all_of(cells.begin(), cells.end(), is_integer)) return false;
    if (rows++ == 0) digits = cells[1].size();
    for (std::size_t c = 1; c < cells.size(); c += 2)
      if (cells[c].size() != digits || !to_count(cells[c])) return false;
  }
  return rows >= few && digits > 1;
}

// Rows without a header that may be other than x, y and z first are refused.
void table_reader::check_first_columns(const std::vector<std::string_view>& first_cells,
                                       const std::string& row) const {
  constexpr std::size_t many = 10;
  if (split(row, separator_).size() > 3 && first_cells.size() >= many && counts_rows(first_cells))
    file_.fail("has no header, and its first column counts the rows", remedy_of(kind_));
  if (starts_with_no_coordinate(separator_, decimal_comma_))
    file_.fail("has no header, and its first column may be identifiers or times: " + quoted(trim(row)),
               remedy_of(kind_));
  if (separator_ == ',' && has_commas_of_two_kinds())
    file_.fail("has no header, and its commas may be those of decimals: " + quoted(trim(row)),
               "Separate the columns by semicolons, or name them above the rows");
}

void table_reader::find_format() {
  std::vector<std::string_view> first_cells;
  bool all_quoted = true;
  if (!has_header()) {
    columns_.x = 0, columns_.y = 1, columns_.z = 2;
    columns_.units = {1, 1, 1};
  }
  std::optional<std::size_t> first_row;
  for (std::size_t i = 0; i < ahead_.size(); ++i) {
    const std::string_view line = trim(ahead_[i].text);
    if (is_no_row(line)) continue;
    if (!first_row) first_row = i;
    all_quoted = all_quoted && (line.starts_with('"') || line.starts_with('\''));
  }
  if (!first_row) return;
  const auto set = [&](char separator, bool decimal_comma, std::size_t row_names) {
    separator_ = separator, decimal_comma_ = decimal_comma, row_names_ = row_names;
  };
  for (const std::size_t row_names : {std::size_t(0), std::size_t(1)})
    for (const char separator : separators) {
      if (given_separator_ && separator != *given_separator_) continue;
      first_cells.clear();
      for (const numbered_line& line : ahead_)
        if (!is_no_row(line.text))
          first_cells.push_back(field_reader(line.text, separator).next().value_or(""));
      const bool have_names = all_quoted || (may_have_row_names(separator) && counts_rows(first_cells));
      if (row_names == 1 ? !have_names : (!has_header() && all_quoted)) continue;
      for (const bool decimal_comma : {false, true}) {
        if (decimal_comma && separator == ',' && !has_quoted_decimals()) continue;
        if (!fits(separator, decimal_comma, row_names)) continue;
        set(separator, decimal_comma, row_names);
        if (!has_header() && row_names == 0) check_first_columns(first_cells, ahead_[*first_row].text);
        return;
      }
    }
  // Whatever is wrong with the rows, it is said of the first one that is.
  const std::string& row = ahead_[*first_row].text;
  const auto occurring =
      std::find_if(separators.begin(), separators.end(), [&](char c) { return row.find(c) != row.npos; });
  set(given_separator_.value_or(occurring == separators.end() ? ' ' : *occurring), false, 0);
  const std::size_t cells = split(row, separator_).size();
  if (has_header() && names_.size() != cells && kind_ == table_of::points)
    file_.fail("has a header with " + std::to_string(names_.size()) + " names above lines of " +
                   std::to_string(cells) + " fields",
               remedy_of(kind_));
}

bool table_reader::next() {
  while (true) {
    std::string_view line;
    if (!ahead_.empty()) {
      line_ = std::move(ahead_.front().text);
      line_number_ = ahead_.front().number;
      ahead_.pop_front();
      line = line_;
    } else if (const auto read = file_.read_line()) {
      line = *read;
      line_number_ = file_.line_number();
    } else {
      blocks_.end();
      return false;
    }
    if (is_blank(line) || is_comment(line)) continue;
    if (is_count(line)) {
      blocks_.begin(*to_count(trim(line)));
      continue;
    }
    blocks_.add_row();
    if (has_header()) require_same_sign(line);
    const std::size_t cells = cut(line, separator_, row_names_, cells_, needed_cells_);
    if (!has_header() || cells == names_.size()) return true;
    cut(line, separator_, row_names_, cells_, all_cells);
    while (cells_.size() > names_.size() && (is_open_ended_ || cells_.back().empty())) cells_.pop_back();
    if (separator_ == '\t' && cells_.size() < names_.size()) cells_.resize(names_.size());
    if (cells_.size() != names_.size())
      fail_at_row("has " + std::to_string(cells_.size()) + " fields, but the header names " +
                      std::to_string(names_.size()),
                  "Mend the line; numbers have decimal points, and text with separators is quoted");
    return true;
  }
}

std::optional<double> table_reader::number(std::size_t column) const {
  const auto value = number_as_written(column);
  return value && column < columns_.units.size() ? std::optional(*value * columns_.units[column]) : value;
}

std::optional<double> table_reader::number_as_written(std::size_t column) const {
  return column < cells_.size() ? to_number(cells_[column], decimal_comma_) : std::nullopt;
}

bool table_reader::says_unknown(std::size_t column) const {
  if (column >= cells_.size()) return false;
  if (const auto value = number_as_written(column)) return is_unknown_number(*value);
  constexpr std::string_view words[] = {"",   "na", "n/a",  "nan",  "null", "none", "-",
                                        "--", ".",  "#n/a", "<na>", "n.a.", "n.d.", "nd"};
  return std::find(std::begin(words), std::end(words), lower_case(cells_[column])) != std::end(words);
}

void table_reader::fail_at_row(std::string_view problem, std::string_view remedy) const {
  file_.fail("line " + std::to_string(line_number_) + " " + std::string(problem), remedy);
}

}  // namespace globalmatch::support

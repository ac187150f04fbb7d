#include "support/column_names.hpp"

#include <algorithm>
#include <initializer_list>
#include <span>

#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

bool is_one_of(std::string_view word, std::span<const std::string_view> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

// Words of letters, digits and colons, in lower case.
std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words;
  bool within = false;
  for (const char c : lower_case(name)) {
    const bool is_part = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == ':' || (c & 0x80);
    if (is_part && !within) words.emplace_back();
    if (is_part) words.back() += c;
    within = is_part;
  }
  return words;
}

std::optional<double> unit_named(std::string_view word) {
  constexpr struct {
    std::string_view word;
    double metres;
  } units[] = {{"m", 1},       {"meter", 1},     {"meters", 1},     {"metre", 1},     {"metres", 1},
               {"cm", 0.01},   {"mm", 0.001},    {"ft", 0.3048},    {"feet", 0.3048}, {"foot", 0.3048},
               {"in", 0.0254}, {"inch", 0.0254}, {"inches", 0.0254}};
  for (const auto& u : units)
    if (word == u.word) return u.metres;
  return std::nullopt;
}

bool names_an_angle(std::string_view word) {
  constexpr std::string_view angles[] = {"deg", "degree", "degrees",   "\xC2\xB0",
                                         "lon", "lat",    "longitude", "latitude"};
  return is_one_of(word, angles);
}

// Words that a coordinate may have around it.
bool says_whose(std::string_view word) {
  constexpr std::string_view words[] = {"tree",   "stem",       "point", "points", "pos", "position",
                                        "coord",  "coords",     "loc",   "local",  "utm", "plot",
                                        "global", "coordinate", "map",   "xyz"};
  return is_one_of(word, words);
}

struct known_name {
  std::string_view word;
  quantity what;
  int rank;
};
constexpr known_name known_names[] = {{"x", quantity::x, 1},          {"y", quantity::y, 1},
                                      {"z", quantity::z, 1},          {"gx", quantity::x, 2},
                                      {"gy", quantity::y, 2},         {"gz", quantity::z, 2},
                                      {"px", quantity::x, 2},         {"py", quantity::y, 2},
                                      {"pz", quantity::z, 2},         {"easting", quantity::x, 3},
                                      {"northing", quantity::y, 3},   {"elevation", quantity::z, 3},
                                      {"east", quantity::x, 3},       {"north", quantity::y, 3},
                                      {"elev", quantity::z, 3},       {"rechtswert", quantity::x, 3},
                                      {"hochwert", quantity::y, 3},   {"altitude", quantity::z, 3},
                                      {"longitude", quantity::x, 4},  {"latitude", quantity::y, 4},
                                      {"alt", quantity::z, 3},        {"lon", quantity::x, 4},
                                      {"lat", quantity::y, 4},        {"radius", quantity::radius, 1},
                                      {"dbh", quantity::diameter, 1}, {"diameter", quantity::diameter, 2},
                                      {"bhd", quantity::diameter, 2}, {"up", quantity::z, 3},
                                      {"este", quantity::x, 3},       {"norte", quantity::y, 3},
                                      {"cota", quantity::z, 3},       {"ost", quantity::x, 3},
                                      {"nord", quantity::y, 3},       {"xcoord", quantity::x, 2},
                                      {"ycoord", quantity::y, 2},     {"zcoord", quantity::z, 2}};

// `points:2` or `points_2`, as ParaView and others name the components of a vector, if it is of places:
// colours and normals have components, too.
std::optional<quantity> component_of(std::span<const std::string> words) {
  constexpr std::string_view places[] = {"point", "points", "coord",    "coords",
                                         "xyz",   "pos",    "position", "coordinates"};
  const std::string& last = words.back();
  const std::size_t colon = last.find(':');
  const bool has_colon = colon != std::string::npos;
  const std::string_view vector = has_colon           ? std::string_view(last).substr(0, colon)
                                  : words.size() == 2 ? std::string_view(words[0])
                                                      : std::string_view();
  const std::string_view digit = has_colon ? std::string_view(last).substr(colon + 1) : last;
  constexpr quantity axes[] = {quantity::x, quantity::y, quantity::z};
  if (!is_one_of(vector, places) || digit.size() != 1 || digit[0] < '0' || digit[0] > '2')
    return std::nullopt;
  return axes[digit[0] - '0'];
}

// The column of the smallest rank; `is_double` where there are two of them.
std::optional<std::size_t> best_of(const std::vector<column_meaning>& columns, quantity what,
                                   bool& is_double) {
  std::optional<std::size_t> best;
  is_double = false;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i].what != what) continue;
    if (best && columns[i].rank == columns[*best].rank) is_double = true;
    if (best && columns[i].rank >= columns[*best].rank) continue;
    is_double = false;
    best = i;
  }
  return best;
}

// E, N and H, and heights beside an easting, which are coordinates only together.
void understand_letters(const std::vector<std::string_view>& names, table_of kind,
                        std::vector<column_meaning>& columns) {
  const auto find = [&](std::initializer_list<std::string_view> words) -> std::optional<std::size_t> {
    for (std::size_t i = 0; i < names.size(); ++i) {
      const auto own = words_of(names[i]);
      for (const std::string_view word : words)
        if (own.size() <= 2 && !own.empty() && own[0] == word) return i;
    }
    return std::nullopt;
  };
  const auto is_missing = [&](quantity what) {
    return std::none_of(columns.begin(), columns.end(),
                        [&](const column_meaning& c) { return c.what == what; });
  };
  const auto east = find({"e"}), north = find({"n"});
  if (east && north && is_missing(quantity::x) && is_missing(quantity::y)) {
    columns[*east].what = quantity::x;
    columns[*north].what = quantity::y;
    columns[*east].rank = columns[*north].rank = 5;
  }
  bool ignored = false;
  const auto x = best_of(columns, quantity::x, ignored);
  if (kind != table_of::points || !x || columns[*x].rank < 3 || !is_missing(quantity::z)) return;
  constexpr std::string_view heights[] = {"h", "height", "u", "hoehe", "h\xC3\xB6he", "h\xC3\x96he"};
  const auto names_height = [&](std::string_view name) {
    const auto own = words_of(name);
    return !own.empty() && own.size() <= 2 && is_one_of(own[0], heights);
  };
  if (std::count_if(names.begin(), names.end(), names_height) > 1) return;  // of which kind is not said
  const auto height = std::find_if(names.begin(), names.end(), names_height);
  if (height == names.end()) return;
  column_meaning& column = columns[std::size_t(height - names.begin())];
  column = {quantity::z, 5, column.unit, false};
}

// Coordinates of one table belong together: of the kinds of names (x, gx, easting), those of the first kind
// that is complete are kept, or of the first with x and y, with the best heights. x beside northing is none.
// Stems with x and y are there, whatever maps have further on.
// False where both x and gx are there and no height tells which: one is within a part of the plot. Of stems
// gz alone tells.
bool keep_one_set(std::vector<column_meaning>& columns, table_of kind) {
  constexpr int ranks = 6;
  const auto is_of = [](const column_meaning& c, int rank) {  // `x` and `y (m)` are of one kind
    return c.rank == rank || (rank == 1 && c.rank == 0);
  };
  const auto has = [&](quantity what, int rank) {
    return std::any_of(columns.begin(), columns.end(),
                       [&](const column_meaning& c) { return c.what == what && is_of(c, rank); });
  };
  std::optional<int> plane, complete;
  for (int rank = ranks; rank-- > 0;) {
    if (!has(quantity::x, rank) || !has(quantity::y, rank)) continue;
    plane = rank;
    if (has(quantity::z, rank)) complete = rank;
  }
  constexpr int of_map = 3;  // ranks from here on: easting and its like
  if (kind == table_of::stems && complete && *complete >= of_map && *plane < of_map) complete.reset();
  const bool has_both =
      has(quantity::x, 1) && has(quantity::y, 1) && has(quantity::x, 2) && has(quantity::y, 2);
  const bool is_clear = !has_both || has(quantity::z, 2) || (kind == table_of::points && has(quantity::z, 1));
  for (column_meaning& c : columns) {
    const bool is_place = c.what == quantity::x || c.what == quantity::y;
    const bool is_other = complete ? !is_of(c, *complete) : !plane || !is_of(c, *plane);
    if ((is_place && is_other) || (c.what == quantity::z && complete && is_other)) c.what = quantity::other;
  }
  return is_clear;
}

}  // namespace

column_meaning meaning_of(std::string_view name) {
  column_meaning meaning;
  std::vector<std::string> left;
  const std::vector<std::string> words = words_of(name);
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (names_an_angle(words[i])) meaning.is_angle = true;
    if (const auto unit = unit_named(words[i]); unit && i > 0)
      meaning.unit = unit;
    else if (words[i].find(':') != std::string::npos || !(says_whose(words[i]) && words.size() > 1))
      left.push_back(words[i]);
  }
  if (meaning.is_angle)
    std::erase_if(left, [](const std::string& word) {
      return word == "deg" || word == "degree" || word == "degrees" || word == "\xC2\xB0";
    });
  if (left.size() != 1) return meaning;
  if (const auto component = component_of(words)) {
    meaning.what = *component;
    meaning.rank = 2;
    return meaning;
  }
  for (const known_name& known : known_names) {
    if (left[0] != known.word) continue;
    meaning.what = known.what;
    meaning.rank = known.rank - (words.size() == 1 && known.rank == 1);
  }
  return meaning;
}

known_columns find_columns(const std::vector<std::string_view>& names, table_of kind, std::string& problem) {
  std::vector<column_meaning> columns;
  for (const std::string_view name : names) columns.push_back(meaning_of(name));
  understand_letters(names, kind, columns);
  known_columns found;
  for (const column_meaning& c : columns) found.units.push_back(c.unit.value_or(1));
  problem.clear();
  const auto take = [&](quantity what) {
    bool is_double = false;
    const auto column = best_of(columns, what, is_double);
    if (is_double) problem = "has two columns that may be that of '" + std::string(names[*column]) + "'";
    if (column && columns[*column].is_angle)
      problem = "has angles in column '" + std::string(names[*column]) + "'";
    return column;
  };
  found.radius = take(quantity::radius);
  found.diameter = take(quantity::diameter);
  problem.clear();  // of several diameters the first one counts
  const bool is_clear = keep_one_set(columns, kind);
  found.x = take(quantity::x);
  found.y = take(quantity::y);
  found.z = take(quantity::z);
  if (!is_clear) problem = "has two pairs of columns that may be x and y";
  return found;
}

}  // namespace globalmatch::support

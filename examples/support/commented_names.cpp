#include "support/commented_names.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "support/column_names.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

template <std::size_t N>
bool has_word(const std::array<std::string_view, N>& words, std::string_view word) {
  const std::string small = lower_case(word);
  return std::find(words.begin(), words.end(), small) != words.end();
}

constexpr std::array<std::string_view, 6> announcing = {"columns", "column", "fields",
                                                        "field",   "format", "are"};
constexpr std::array<std::string_view, 13> of_sentences = {"and", "in",   "is", "of", "the", "with", "to",
                                                           "for", "from", "by", "at", "all", "are"};
constexpr std::array<std::string_view, 7> polar = {"range",  "distance", "dist", "azimuth",
                                                   "zenith", "theta",    "phi"};
constexpr std::array<std::string_view, 12> other_columns = {
    "id", "time", "intensity", "i", "r", "g", "b", "red", "green", "blue", "return", "class"};

bool is_known(std::string_view word) {
  return meaning_of(word).what != quantity::other || has_word(polar, word) || has_word(other_columns, word);
}

}  // namespace

std::string with_joined_units(std::string_view header) {
  std::string joined;
  for (std::size_t i = 0; i < header.size(); ++i) {
    if (header[i] == '[' || header[i] == '(') {
      const std::size_t end = header.find_first_of(" \t])", i + 1);
      const bool is_one_word = end < header.size() && (header[end] == ']' || header[end] == ')');
      while (is_one_word && joined.ends_with(' ')) joined.pop_back();
    }
    joined += header[i];
  }
  return joined;
}

std::string_view announced_names(std::string_view comment) {
  std::string_view names = comment;
  std::size_t end = 0;
  for (std::size_t begin = 0; begin < comment.size(); begin = end + 1) {
    end = std::min(comment.find_first_of(" \t", begin), comment.size());
    std::string_view word = comment.substr(begin, end - begin);
    if (word.ends_with(':') || has_word(announcing, word)) names = trim(comment.substr(end));
  }
  return names.empty() ? comment : names;
}

bool is_harmless_sentence(const std::vector<std::string_view>& words, std::size_t x, std::size_t y,
                          std::size_t z, std::size_t cells) {
  const bool is_sentence =
      std::any_of(words.begin(), words.end(), [](std::string_view w) { return has_word(of_sentences, w); });
  return is_sentence && x < y && y < z && (cells == 3 || x == 0);
}

bool is_prose(const std::vector<std::string_view>& words) {
  constexpr int rarest_letters = 2;  // the rank of gx and its like; words come behind
  const auto letters = std::count_if(words.begin(), words.end(), [](std::string_view word) {
    const column_meaning meaning = meaning_of(word);
    const bool is_place =
        meaning.what == quantity::x || meaning.what == quantity::y || meaning.what == quantity::z;
    return is_place && meaning.rank <= rarest_letters;
  });
  return letters < 2 && !std::all_of(words.begin(), words.end(), is_known);
}

bool names_other_coordinates(const std::vector<std::string_view>& words) {
  return std::count_if(words.begin(), words.end(), [](std::string_view word) {
           const quantity what = meaning_of(word).what;
           return what == quantity::x || what == quantity::y || what == quantity::z || has_word(polar, word);
         }) > 1;
}

}  // namespace globalmatch::support

// Parts of a report as HTML: numbers in words that people read, tables, lists.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace globalmatch::support {

/// With so many digits behind the decimal point, in every locale.
std::string rounded_to(int digits, double value);

/// With blanks between thousands.
std::string counted(std::size_t count);

/// "0.4 cm", "12 cm", "1.3 m", "less than 0.1 cm"; "not known" where it is not finite.
std::string as_length(double metres);

/// "96.3 %", "more than 99.9 %"
std::string as_percentage(double share);

/// A cell of a table, as markup.
struct html_cell {
  std::string markup;
  bool is_number = false;
};

html_cell text_cell(std::string_view text);
/// Of sentences: names between backticks are set as code.
html_cell prose_cell(std::string_view text);
html_cell number_cell(std::string_view text);
/// A bar that is filled to this share, which must be beside the number that it shows.
html_cell bar_cell(double share);

/// A table that scrolls where it is wider than the page. Heads are aligned as the numbers below them.
class html_table {
 public:
  html_table(std::string_view caption, std::vector<std::string> heads);
  /// One row; the first cell is its head.
  void add(const std::vector<html_cell>& cells);
  std::string markup() const;

 private:
  std::string caption_, body_;
  std::vector<std::string> heads_;
  std::vector<bool> has_numbers_;  // of each column
};

/// "<p>...</p>", of sentences
std::string paragraph(std::string_view text);

/// A list of sentences, empty where there are none.
std::string bullet_list(const std::vector<std::string>& lines);

/// What is shown when its summary is chosen, and printed always.
std::string folded(std::string_view summary, std::string_view markup);

/// A picture in SVG with a caption.
std::string figure(std::string_view svg, std::string_view caption);

}  // namespace globalmatch::support

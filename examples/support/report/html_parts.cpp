#include "support/report/html_parts.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <locale>
#include <sstream>
#include <utility>

#include "support/markup.hpp"

namespace globalmatch::support {

std::string rounded_to(int digits, double value) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << std::fixed << std::setprecision(digits) << value;
  return text.str();
}

std::string counted(std::size_t count) {
  constexpr std::string_view narrow_blank = "\u202f";  // that no line is broken at
  std::string digits = std::to_string(count);
  if (count < 10000) return digits;
  for (std::size_t at = digits.size(); at > 3;) digits.insert(at -= 3, narrow_blank);
  return digits;
}

std::string as_length(double metres) {
  const double cm = 100 * metres;
  if (!std::isfinite(cm)) return "not known";
  if (cm >= 100) return rounded_to(1, metres) + " m";
  if (cm < 0.1) return "less than 0.1 cm";
  return rounded_to(cm < 10 ? 1 : 0, cm) + " cm";
}

std::string as_percentage(double share) {
  constexpr double nearly_sure = 0.999;
  if (share > nearly_sure) return "more than 99.9 %";
  if (share < 1 - nearly_sure) return "less than 0.1 %";
  return rounded_to(1, 100 * share) + " %";
}

html_cell text_cell(std::string_view text) {
  return {escaped(text)};
}

html_cell prose_cell(std::string_view text) {
  const std::string safe = escaped(text);
  std::string markup;
  for (std::size_t at = 0; at < safe.size();) {
    const std::size_t opened = safe.find('`', at), closed = safe.find('`', opened + 1);
    if (opened == std::string::npos || closed == std::string::npos) return {markup + safe.substr(at)};
    markup +=
        safe.substr(at, opened - at) + "<code>" + safe.substr(opened + 1, closed - opened - 1) + "</code>";
    at = closed + 1;
  }
  return {markup};
}

html_cell number_cell(std::string_view text) {
  return {escaped(text), true};
}

html_cell bar_cell(double share) {
  const double filled = std::isfinite(share) ? std::clamp(share, 0.0, 1.0) : 0;
  return {"<span class=\"bar\" aria-hidden=\"true\"><span style=\"width:" + rounded_to(1, 100 * filled) +
          "%\"></span></span>"};
}

namespace {

std::string alignment_of(bool is_number) {
  return is_number ? " class=\"number\"" : "";
}

}  // namespace

html_table::html_table(std::string_view caption, std::vector<std::string> heads)
    : caption_(escaped(caption)), heads_(std::move(heads)), has_numbers_(heads_.size()) {}

void html_table::add(const std::vector<html_cell>& cells) {
  body_ += "<tr>";
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const std::string kind = alignment_of(cells[c].is_number);
    if (cells[c].is_number) has_numbers_.at(c) = true;
    body_ += c == 0 ? "<th scope=\"row\"" + kind + ">" + cells[c].markup + "</th>"
                    : "<td" + kind + ">" + cells[c].markup + "</td>";
  }
  body_ += "</tr>\n";
}

std::string html_table::markup() const {
  std::string head;
  for (std::size_t c = 0; c < heads_.size(); ++c)
    head += heads_[c].empty()
                ? "<td></td>"
                : "<th scope=\"col\"" + alignment_of(has_numbers_[c]) + ">" + escaped(heads_[c]) + "</th>";
  return "<div class=\"scroll\" role=\"region\" tabindex=\"0\" aria-label=\"" + caption_ +
         "\"><table>\n<caption>" + caption_ + "</caption>\n<thead><tr>" + head + "</tr></thead>\n<tbody>\n" +
         body_ + "</tbody></table></div>\n";
}

std::string paragraph(std::string_view text) {
  return "<p>" + prose_cell(text).markup + "</p>\n";
}

std::string bullet_list(const std::vector<std::string>& lines) {
  if (lines.empty()) return "";
  std::string items;
  for (const std::string& line : lines) items += "<li>" + prose_cell(line).markup + "</li>\n";
  return "<ul>\n" + items + "</ul>\n";
}

std::string folded(std::string_view summary, std::string_view markup) {
  return "<details><summary>" + escaped(summary) + "</summary>\n" + std::string(markup) + "</details>\n";
}

std::string figure(std::string_view svg, std::string_view caption) {
  return "<figure>\n" + std::string(svg) + "<figcaption>" + escaped(caption) + "</figcaption></figure>\n";
}

}  // namespace globalmatch::support

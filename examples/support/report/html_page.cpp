#include "support/report/html_page.hpp"

#include <ostream>
#include <string_view>

#include "support/atomic_file.hpp"
#include "support/markup.hpp"
#include "support/report/embedded_files.hpp"
#include "support/report/html_parts.hpp"

namespace globalmatch::support {

namespace {

/// JSON that an element of a page may hold: nothing in it ends the element.
std::string json_for_script(const nlohmann::ordered_json& value) {
  std::string safe;
  for (const char c : value.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace))
    safe += c == '<' ? std::string("\\u003c") : std::string(1, c);
  return safe;
}

std::string_view mark_of(trust_level level) {
  return level == trust_level::full ? "&#10003;" : level == trust_level::partial ? "!" : "&#10007;";
}

std::string_view name_of(trust_level level) {
  return level == trust_level::full ? "full" : level == trust_level::partial ? "partial" : "none";
}

void write_head(std::ostream& out, const html_page& page) {
  out << "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      << "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
         "'unsafe-inline'; script-src 'unsafe-inline'; img-src data:\">\n"
      << "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      << "<meta name=\"color-scheme\" content=\"light dark\">\n<title>" << mark_of(page.trust.level) << ' '
      << escaped(page.title) << "</title>\n<style>\n"
      << report_style() << "</style>\n</head>\n";
}

void write_trust(std::ostream& out, const html_page& page) {
  const trust_statement& trust = page.trust;
  out << "<header>\n<h1>" << escaped(page.title) << "</h1>\n</header>\n<main>\n"
      << "<section class=\"trust " << name_of(trust.level) << "\" aria-labelledby=\"outcome\">\n"
      << "<h2 id=\"outcome\"><span class=\"mark\" aria-hidden=\"true\">" << mark_of(trust.level) << "</span> "
      << escaped(trust.headline) << "</h2>\n";
  for (const std::string& sentence : trust.sentences) out << paragraph(sentence);
  out << "<dl>\n";
  for (const trust_figure& f : trust.figures)
    out << "<div><dt>" << escaped(f.label) << "</dt><dd>" << escaped(f.value)
        << (f.note.empty() ? "" : "<small>" + escaped(f.note) + "</small>") << "</dd></div>\n";
  out << "</dl>\n</section>\n";
}

void write_contents(std::ostream& out, const html_page& page) {
  out << "<nav aria-label=\"Contents\"><ul>\n";
  for (const html_section& s : page.sections) {
    out << "<li><a href=\"#" << s.id << "\">" << escaped(s.heading) << "</a></li>\n";
    if (&s == &page.sections.front()) out << "<li><a href=\"#view\">3-D view</a></li>\n";
  }
  out << "</ul></nav>\n";
}

void write_view(std::ostream& out, const html_page& page) {
  out << "<section id=\"view\" aria-labelledby=\"view_heading\">\n<h2 id=\"view_heading\">3-D view</h2>\n";
  if (page.view.is_null()) {
    out << paragraph(page.without_view) << "</section>\n";
    return;
  }
  out << "<div id=\"view_3d\"><p>The view of the points in space needs JavaScript and WebGL, which this "
         "browser does not offer here.</p></div>\n</section>\n";
}

}  // namespace

bool has_view_3d() {
  return !report_script().empty();
}

void write_html_page(const std::filesystem::path& path, const html_page& page) {
  atomic_file file(path);
  std::ostream& out = file.stream();
  write_head(out, page);
  out << "<body>\n";
  write_trust(out, page);
  write_contents(out, page);
  for (const html_section& s : page.sections) {
    out << "<section id=\"" << s.id << "\" aria-labelledby=\"" << s.id << "_heading\">\n<h2 id=\"" << s.id
        << "_heading\">" << escaped(s.heading) << "</h2>\n"
        << s.markup << "</section>\n";
    if (&s == &page.sections.front()) write_view(out, page);
  }
  out << "</main>\n<footer><p>" << escaped(page.made_by) << "</p></footer>\n";
  if (!page.view.is_null())
    out << "<script type=\"application/json\" id=\"view_data\">" << json_for_script(page.view)
        << "</script>\n<script>\n"
        << report_script() << "</script>\n";
  out << "</body>\n</html>\n";
  file.commit();
}

}  // namespace globalmatch::support

#include "support/report/html_parts.hpp"

#include <limits>

#include "catch.hpp"
#include "support/markup.hpp"

namespace globalmatch::support::test_html_parts {

using Catch::Matchers::Contains;

TEST_CASE("escaped text ends neither an element nor an attribute, and has no control characters") {
  CHECK(escaped("<b a=\"1\" c='2'>&amp;\n") == "&lt;b a=&quot;1&quot; c=&#39;2&#39;&gt;&amp;amp; ");
  CHECK(escaped("Höhe \u202f 2 m") == "Höhe \u202f 2 m");
}

TEST_CASE("lengths, shares and counts are written as people read them") {
  CHECK(as_length(0.0004) == "less than 0.1 cm");
  CHECK(as_length(0.004) == "0.4 cm");
  CHECK(as_length(0.123) == "12 cm");
  CHECK(as_length(1.26) == "1.3 m");
  CHECK(as_length(std::numeric_limits<double>::infinity()) == "not known");
  CHECK(as_percentage(0.9963) == "99.6 %");
  CHECK(as_percentage(0.99999) == "more than 99.9 %");
  CHECK(as_percentage(1e-7) == "less than 0.1 %");
  CHECK(counted(0) == "0");
  CHECK(counted(9999) == "9999");
  CHECK(counted(1234567) == "1\u202f234\u202f567");
  CHECK(rounded_to(2, 1.0 / 3) == "0.33");
}

TEST_CASE("all text of a table is escaped, and its first cells are heads of rows") {
  html_table table("a < b", {"<head>", ""});
  CHECK_THAT(table.markup(), !Contains("class=\"number\""));
  table.add({text_cell("<x>"), number_cell("1 & 2"), bar_cell(2)});
  const std::string markup = table.markup();
  CHECK_THAT(markup, Contains("<caption>a &lt; b</caption>") && Contains("aria-label=\"a &lt; b\"") &&
                         Contains("<th scope=\"col\">&lt;head&gt;</th><td></td>") &&
                         Contains("<th scope=\"row\">&lt;x&gt;</th>") &&
                         Contains("<td class=\"number\">1 &amp; 2</td>") && Contains("width:100.0%"));
}

TEST_CASE("lists, paragraphs, captions and summaries are escaped, and a list of nothing is nothing") {
  CHECK(bullet_list({}).empty());
  CHECK_THAT(bullet_list({"<"}), Contains("<li>&lt;</li>"));
  CHECK(paragraph("<") == "<p>&lt;</p>\n");
  CHECK_THAT(figure("<svg></svg>", "<"), Contains("<svg></svg><figcaption>&lt;</figcaption>"));
  CHECK_THAT(folded("<", "<p></p>"), Contains("<summary>&lt;</summary>\n<p></p></details>"));
}

}  // namespace globalmatch::support::test_html_parts

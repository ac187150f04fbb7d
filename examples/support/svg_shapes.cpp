#include "support/svg_shapes.hpp"

#include <sstream>

#include "support/markup.hpp"

namespace globalmatch::support {

void begin_picture(std::ostream& out, double width, double height, std::string_view title,
                   std::string_view description) {
  out << "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" viewBox=\"0 0 " << width << ' ' << height
      << "\" width=\"" << width << "\" height=\"" << height << "\" font-family=\"sans-serif\">\n"
      << "<title>" << escaped(title) << "</title>\n<desc>" << escaped(description) << "</desc>\n"
      << "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
}

void end_picture(std::ostream& out) {
  out << "</svg>\n";
}

void draw_text(std::ostream& out, double x, double y, std::string_view text, const text_style& style) {
  out << "<text x=\"" << x << "\" y=\"" << y << "\" font-size=\"" << style.size << "\" fill=\""
      << style.colour << "\" text-anchor=\"" << style.anchor << "\" font-weight=\"" << style.weight << "\">"
      << escaped(text) << "</text>\n";
}

void draw_line(std::ostream& out, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  out << "<line x1=\"" << from.x() << "\" y1=\"" << from.y() << "\" x2=\"" << to.x() << "\" y2=\"" << to.y()
      << "\"/>\n";
}

void draw_circle(std::ostream& out, const Eigen::Vector2d& centre, double radius) {
  out << "<circle cx=\"" << centre.x() << "\" cy=\"" << centre.y() << "\" r=\"" << radius << "\"/>\n";
}

void begin_filled(std::ostream& out, std::string_view colour, double edge_width) {
  out << "<g fill=\"" << colour << "\" stroke=\"white\" stroke-width=\"" << edge_width << "\">\n";
}

void begin_hollow(std::ostream& out, std::string_view colour, double line_width) {
  out << "<g fill=\"none\" stroke=\"" << colour << "\" stroke-width=\"" << line_width << "\">\n";
}

void end_group(std::ostream& out) {
  out << "</g>\n";
}

std::vector<std::string> wrapped(const std::string& text, std::size_t width) {
  std::vector<std::string> lines;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (lines.empty() || lines.back().size() + 1 + word.size() > width)
      lines.push_back(word);
    else
      lines.back() += ' ' + word;
  }
  return lines;
}

}  // namespace globalmatch::support

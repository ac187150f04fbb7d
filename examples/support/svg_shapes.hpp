// Internal to the pictures: shapes and texts of SVG. Lengths are in px, y goes down.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

namespace globalmatch::support {

struct text_style {
  double size = 14;
  std::string_view colour = "#222222";
  std::string_view anchor = "start";  ///< what lies at x: "start", "middle" or "end" of the text
  std::string_view weight = "normal";
};

/// Opens a picture on white paper, with a title and a description for those who cannot see it.
void begin_picture(std::ostream& out, double width, double height, std::string_view title,
                   std::string_view description);
void end_picture(std::ostream& out);

/// Any text, also with characters that mean something in XML.
void draw_text(std::ostream& out, double x, double y, std::string_view text, const text_style& style = {});

void draw_line(std::ostream& out, const Eigen::Vector2d& from, const Eigen::Vector2d& to);
void draw_circle(std::ostream& out, const Eigen::Vector2d& centre, double radius);

/// Opens a group: the shapes until `end_group` are filled, with a white edge.
void begin_filled(std::ostream& out, std::string_view colour, double edge_width = 0);
/// Opens a group: the shapes until `end_group` are outlines.
void begin_hollow(std::ostream& out, std::string_view colour, double line_width);
void end_group(std::ostream& out);

/// Breaks a text between words into lines of at most `width` characters, where words are not longer.
std::vector<std::string> wrapped(const std::string& text, std::size_t width);

}  // namespace globalmatch::support

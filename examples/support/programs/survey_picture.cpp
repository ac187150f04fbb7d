#include "support/programs/survey_picture.hpp"

#include <algorithm>
#include <iomanip>
#include <ostream>
#include <sstream>
#include <string_view>

#include <Eigen/Geometry>

#include "support/atomic_file.hpp"
#include "support/svg_shapes.hpp"

namespace globalmatch::support {

namespace {

// Okabe and Ito's colours, which are distinct with any colour vision.
constexpr std::string_view scan_colour = "#0072B2", good_colour = "#009E73", bad_colour = "#D55E00";
constexpr std::string_view tree_colour = "#999999", ink = "#222222", pale_ink = "#666666";

// All lengths of the page are in px.
constexpr double margin = 24, panel_width = 900, panel_top = 96, line_height = 20;
constexpr double max_panel_height = 1400;

bool is_drawn(const survey_row& row, const survey& result) {
  return row.scan && result.scans[*row.scan].component == 0;
}

/// From metres of the survey, y up, to the page.
struct page {
  Eigen::Vector2d low = Eigen::Vector2d::Zero(), high = Eigen::Vector2d::Ones();
  double px_per_metre = 1;

  page(const std::vector<survey_row>& rows, const survey& result) {
    Eigen::AlignedBox2d box;
    for (const survey::tree& t : result.trees)
      if (t.component == 0) box.extend(Eigen::Vector2d(t.position.head<2>()));
    for (const survey_row& row : rows)
      if (is_drawn(row, result))
        box.extend(Eigen::Vector2d(result.scans[*row.scan].survey_from_scan.translation().head<2>()));
    if (box.isEmpty()) return;
    low = box.min();
    high = box.max().cwiseMax(low + Eigen::Vector2d::Ones());
    px_per_metre = std::min(panel_width / (high - low).x(), max_panel_height / (high - low).y());
  }

  double height() const { return (high - low).y() * px_per_metre; }
  Eigen::Vector2d operator()(const Eigen::Vector3d& p) const {
    return {margin + (p.x() - low.x()) * px_per_metre, panel_top + (high.y() - p.y()) * px_per_metre};
  }
};

/// What dots and lines stand for, each beside one of them.
void draw_key(std::ostream& out) {
  constexpr double text_y = 60, middle = text_y - 5, sample = 24, gap = 8;
  const auto explain = [&](double x, std::string_view text) {
    draw_text(out, x + sample + gap, text_y, text, {.colour = pale_ink});
  };
  begin_filled(out, scan_colour, 1);
  draw_circle(out, {margin + sample - 5, middle}, 5);
  end_group(out);
  explain(margin, "scan");
  begin_filled(out, pale_ink);
  draw_circle(out, {margin + 100 + sample - 2, middle}, 1.6);
  end_group(out);
  explain(margin + 100, "tree");
  const auto draw_link = [&](double x, std::string_view colour, std::string_view text) {
    begin_hollow(out, colour, 2.4);
    draw_line(out, {x, middle}, {x + sample, middle});
    end_group(out);
    explain(x, text);
  };
  draw_link(margin + 190, good_colour, "link within 5 cm of the adjusted poses");
  draw_link(margin + 510, bad_colour, "link that is further off");
}

void draw_trees(std::ostream& out, const survey& result, const page& at) {
  for (const bool several : {false, true}) {
    begin_filled(out, several ? pale_ink : tree_colour);
    for (const survey::tree& t : result.trees)
      if (t.component == 0 && (t.seen.size() > 1) == several)
        draw_circle(out, at(t.position), several ? 1.6 : 1.0);
    end_group(out);
  }
}

void draw_links(std::ostream& out, const std::vector<survey_row>& rows, const survey& result,
                const page& at) {
  constexpr double large = 0.05;                        // [m]
  std::vector<bool> drawn(result.scans.size(), false);  // ground control has no place
  for (const survey_row& row : rows)
    if (is_drawn(row, result)) drawn[*row.scan] = true;
  for (const bool is_good : {true, false}) {
    begin_hollow(out, is_good ? good_colour : bad_colour, 1.2);
    for (const survey::link& l : result.links)
      if (l.used && (l.residual < large) == is_good && drawn[l.source] && drawn[l.target])
        draw_line(out, at(result.scans[l.source].survey_from_scan.translation()),
                  at(result.scans[l.target].survey_from_scan.translation()));
    end_group(out);
  }
}

void draw_scans(std::ostream& out, const std::vector<survey_row>& rows, const survey& result,
                const page& at) {
  constexpr std::size_t max_named = 200;  // names of more cover each other
  begin_filled(out, scan_colour, 1);
  std::vector<const survey_row*> drawn;
  for (const survey_row& row : rows)
    if (is_drawn(row, result)) drawn.push_back(&row);
  const auto place_of = [&](const survey_row* row) {
    return at(result.scans[*row->scan].survey_from_scan.translation());
  };
  for (const survey_row* row : drawn) draw_circle(out, place_of(row), 5);
  end_group(out);
  if (drawn.size() > max_named) return;
  for (const survey_row* row : drawn) {
    const Eigen::Vector2d place = place_of(row);
    draw_text(out, place.x() + 7, place.y() - 5, row->name, {.size = 11, .colour = ink});
  }
}

/// What is not in the drawing, and why.
std::vector<std::string> lines_of_others(const std::vector<survey_row>& rows, const survey& result) {
  constexpr std::size_t width = 130, max_lines = 100;
  std::vector<std::string> lines;
  for (const survey_row& row : rows) {
    if (row.scan && result.scans[*row.scan].component == 0) continue;
    std::string text = row.name + ": " + in_words(row.status);
    if (row.scan && result.scans[*row.scan].component > 0)
      text += " in component " + std::to_string(result.scans[*row.scan].component + 1);
    if (!row.reason.empty()) text += ", " + row.reason;
    for (const std::string& line : wrapped(text, width)) lines.push_back(line);
  }
  if (lines.size() > max_lines) {
    lines.resize(max_lines);
    lines.push_back("... and others: see poses.csv");
  }
  return lines;
}

}  // namespace

void draw_survey_picture(std::ostream& out, const std::vector<survey_row>& rows, const survey& result) {
  const page at(rows, result);
  const std::vector<std::string> others = lines_of_others(rows, result);
  const double below = panel_top + at.height() + 2 * line_height;
  out << std::fixed << std::setprecision(1);
  begin_picture(out, panel_width + 2 * margin, below + line_height * double(others.size() + 1),
                summary(rows, result), "Scans, links between them and trees, seen from above");
  draw_text(out, margin, 36, summary(rows, result), {.size = 20, .weight = "bold"});
  draw_key(out);
  std::ostringstream scale;
  scale << std::fixed << std::setprecision(0) << (at.high - at.low).x() << " m by " << (at.high - at.low).y()
        << " m";
  draw_text(out, margin, 80, scale.str(), {.colour = pale_ink});
  draw_trees(out, result, at);
  draw_links(out, rows, result, at);
  draw_scans(out, rows, result, at);
  for (std::size_t i = 0; i < others.size(); ++i)
    draw_text(out, margin, below + line_height * double(i), others[i], {.size = 12});
  end_picture(out);
}

void write_survey_picture(const std::filesystem::path& path, const std::vector<survey_row>& rows,
                          const survey& result) {
  atomic_file file(path);
  draw_survey_picture(file.stream(), rows, result);
  file.commit();
}

}  // namespace globalmatch::support

#include "support/plan_picture.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iterator>
#include <locale>
#include <ostream>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "support/atomic_file.hpp"
#include "support/svg_shapes.hpp"

namespace globalmatch::support {

namespace {

using horizontal_points = std::vector<Eigen::Vector2d>;
using box_2d = Eigen::AlignedBox2d;

// Okabe and Ito's colours, which are distinct with any colour vision.
constexpr std::string_view target_colour = "#0072B2";
constexpr std::string_view source_colour = "#D55E00";
constexpr std::string_view halo_colour = "#F0E442";
constexpr std::string_view ink = "#222222";
constexpr std::string_view pale_ink = "#666666";

// Where two matched stems coincide, that of the source is drawn this much smaller, so that both are seen.
constexpr double inner_share = 0.55;

// All lengths of the page are in px.
constexpr double margin = 24;
constexpr double panel_width = 560;
constexpr double panel_gap = 28;
constexpr double panel_top = 84;
constexpr double panel_padding = 22;
constexpr double page_width = 2 * (margin + panel_width) + panel_gap;
constexpr double left_panel = margin;
constexpr double right_panel = margin + panel_width + panel_gap;
constexpr double line_height = 22;

// How metres become px: the same for both panels.
struct page_scale {
  double px_per_metre;
  double panel_height;
  double min_radius;     ///< [px] of a circle
  double radius_factor;  ///< stems are drawn this many times too thick, so that their sizes are seen
};

void require_valid(const plan_picture::map& map, const std::string& name) {
  for (const Eigen::Vector3d& p : map.positions)
    if (!p.allFinite()) throw std::invalid_argument("plan_picture: " + name + ".positions must be finite");
  if (!map.radii.empty() && map.radii.size() != map.positions.size())
    throw std::invalid_argument("plan_picture: " + name + ".radii must be none, or one for each stem");
}

void require_valid(const plan_picture& picture) {
  require_valid(picture.source, "source");
  require_valid(picture.target, "target");
  for (const auto& [source, target] : picture.matches)
    if (source >= picture.source.positions.size() || target >= picture.target.positions.size())
      throw std::invalid_argument("plan_picture: matches name a stem that does not exist");
}

horizontal_points horizontal(std::span<const Eigen::Vector3d> positions,
                             const Eigen::Isometry3d& transform = Eigen::Isometry3d::Identity()) {
  horizontal_points points;
  for (const Eigen::Vector3d& p : positions) points.push_back((transform * p).head<2>());
  return points;
}

box_2d box_of(const horizontal_points& points) {
  box_2d box;
  for (const Eigen::Vector2d& p : points) box.extend(p);
  return box;
}

horizontal_points recentred(horizontal_points points) {
  const box_2d box = box_of(points);
  for (Eigen::Vector2d& p : points) p -= box.center();
  return points;
}

std::vector<double> known_radii(const plan_picture& picture) {
  std::vector<double> known;
  for (const auto& map : {picture.source, picture.target})
    std::copy_if(map.radii.begin(), map.radii.end(), std::back_inserter(known),
                 [](double radius) { return std::isfinite(radius) && radius > 0; });
  return known;
}

// Thickens stems until a usual one is well seen, by a whole number that the legend can state.
double radius_factor(std::vector<double> radii, double px_per_metre, double usual_px) {
  if (radii.empty()) return 1;
  const auto median = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
  std::nth_element(radii.begin(), median, radii.end());
  return std::max(1.0, std::round(usual_px / (*median * px_per_metre)));
}

page_scale scale_for(const box_2d& left, const box_2d& right, const plan_picture& picture) {
  constexpr double min_extent = 2;  // [m] keeps a map of one stem drawable
  const Eigen::Vector2d extent = left.sizes().cwiseMax(right.sizes()).cwiseMax(min_extent);
  const double room = panel_width - 2 * panel_padding;
  const double px_per_metre = room / extent.maxCoeff();
  const double height = std::max(extent.y() * px_per_metre + 2 * panel_padding, 0.5 * panel_width);
  const std::size_t stems =
      std::max({picture.source.positions.size(), picture.target.positions.size(), std::size_t{1}});
  const double usual_px = std::clamp(0.2 * room / std::sqrt(static_cast<double>(stems)), 1.2, 7.0);
  return {px_per_metre, height, 0.5 * usual_px, radius_factor(known_radii(picture), px_per_metre, usual_px)};
}

std::string rounded(double value) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << value;
  return text.str();
}

// From metres to a panel; y of the map goes up, y of the page down.
class panel_frame {
 public:
  panel_frame(double left, const page_scale& scale, const Eigen::Vector2d& map_center)
      : middle_(left + panel_width / 2, panel_top + scale.panel_height / 2),
        map_center_(map_center),
        scale_(scale) {}

  Eigen::Vector2d place(const Eigen::Vector2d& p) const {
    const Eigen::Vector2d offset = (p - map_center_) * scale_.px_per_metre;
    return {middle_.x() + offset.x(), middle_.y() - offset.y()};
  }

  double radius(const plan_picture::map& map, std::size_t stem) const {
    const double radius = map.radii.empty() ? 0 : map.radii[stem];
    const double drawn = radius * scale_.px_per_metre * scale_.radius_factor;
    return std::clamp(std::isfinite(drawn) ? drawn : 0, scale_.min_radius, 6 * scale_.min_radius);
  }

  // Thinner where the circles are small.
  double line_width() const { return std::min(1.5, scale_.min_radius); }
  double edge_width() const { return 0.2 * scale_.min_radius; }
  double halo_width() const { return std::min(4.0, scale_.min_radius); }
  Eigen::Vector2d middle() const { return middle_; }

 private:
  Eigen::Vector2d middle_, map_center_;
  page_scale scale_;
};

void draw_stems(std::ostream& out, const panel_frame& frame, const horizontal_points& points,
                const plan_picture::map& map, const std::vector<bool>& chosen, double share = 1) {
  for (std::size_t i = 0; i < points.size(); ++i)
    if (chosen[i]) draw_circle(out, frame.place(points[i]), share * frame.radius(map, i));
}

void draw_panel(std::ostream& out, double left, const page_scale& scale, std::string_view heading) {
  draw_text(out, left, panel_top - 10, heading, {.size = 15, .colour = ink, .weight = "bold"});
  out << "<rect x=\"" << left << "\" y=\"" << panel_top << "\" width=\"" << panel_width << "\" height=\""
      << scale.panel_height << "\" rx=\"4\" fill=\"#FAFAFA\" stroke=\"#CCCCCC\"/>\n";
}

void draw_as_they_came(std::ostream& out, const plan_picture& picture, const page_scale& scale,
                       const horizontal_points& source, const horizontal_points& target) {
  draw_panel(out, left_panel, scale, "As they came: each in its own frame, recentred");
  const panel_frame frame(left_panel, scale, Eigen::Vector2d::Zero());
  begin_filled(out, target_colour, frame.edge_width());
  draw_stems(out, frame, target, picture.target, std::vector<bool>(target.size(), true));
  end_group(out);
  begin_filled(out, source_colour, frame.edge_width());
  draw_stems(out, frame, source, picture.source, std::vector<bool>(source.size(), true));
  end_group(out);
}

struct matched_stems {
  std::vector<bool> source, target;
};

matched_stems matched_in(const plan_picture& picture) {
  matched_stems matched = {std::vector<bool>(picture.source.positions.size()),
                           std::vector<bool>(picture.target.positions.size())};
  for (const auto& [source, target] : picture.matches) matched.source[source] = matched.target[target] = true;
  return matched;
}

// The matched stems of one map filled, the others hollow.
void draw_map(std::ostream& out, const panel_frame& frame, const horizontal_points& points,
              const plan_picture::map& map, std::vector<bool> matched, std::string_view colour,
              double matched_share) {
  begin_filled(out, colour, frame.edge_width());
  draw_stems(out, frame, points, map, matched, matched_share);
  end_group(out);
  matched.flip();
  begin_hollow(out, colour, frame.line_width());
  draw_stems(out, frame, points, map, matched);
  end_group(out);
}

void draw_halos(std::ostream& out, const panel_frame& frame, const plan_picture& picture,
                const horizontal_points& source, const horizontal_points& target) {
  begin_filled(out, halo_colour);
  for (const auto& [s, t] : picture.matches) {
    const Eigen::Vector2d from = frame.place(source[s]), to = frame.place(target[t]);
    const double largest = std::max(frame.radius(picture.source, s), frame.radius(picture.target, t));
    draw_circle(out, (from + to) / 2, (to - from).norm() / 2 + largest + frame.halo_width());
  }
  end_group(out);
}

void draw_match_lines(std::ostream& out, const panel_frame& frame, const plan_picture& picture,
                      const horizontal_points& source, const horizontal_points& target) {
  begin_hollow(out, ink, frame.line_width());
  for (const auto& [s, t] : picture.matches) draw_line(out, frame.place(source[s]), frame.place(target[t]));
  end_group(out);
}

void draw_registered(std::ostream& out, const plan_picture& picture, const page_scale& scale,
                     const horizontal_points& source, const horizontal_points& target, const box_2d& box) {
  draw_panel(out, right_panel, scale, "After matching: both in the frame of the target");
  const panel_frame frame(right_panel, scale, box.center());
  if (!picture.target_from_source) {
    draw_text(out, frame.middle().x(), frame.middle().y(), "No registration to show",
              {.size = 18, .colour = pale_ink, .anchor = "middle"});
    return;
  }
  const matched_stems matched = matched_in(picture);
  draw_halos(out, frame, picture, source, target);
  draw_map(out, frame, target, picture.target, matched.target, target_colour, 1);
  draw_map(out, frame, source, picture.source, matched.source, source_colour, inner_share);
  draw_match_lines(out, frame, picture, source, target);
}

// Five metres where that is a visible length, else the nearest power of ten times as much.
double scale_bar_metres(const page_scale& scale) {
  constexpr double shortest_px = 25;
  double metres = 5;
  while (metres * scale.px_per_metre < shortest_px) metres *= 10;
  while (metres * scale.px_per_metre > panel_width / 2) metres /= 10;
  return metres;
}

void draw_scale_bar(std::ostream& out, double left, double y, const page_scale& scale) {
  const double metres = scale_bar_metres(scale);
  const double right = left + metres * scale.px_per_metre;
  out << "<g stroke=\"" << ink << "\" stroke-width=\"2\">\n";
  draw_line(out, {left, y}, {right, y});
  for (const double x : {left, right}) draw_line(out, {x, y - 4}, {x, y + 4});
  end_group(out);
  draw_text(out, right + 8, y + 5, rounded(metres) + " m in both panels");
}

enum class legend_mark { target, source, matched, only_target, only_source };

struct legend_entry {
  legend_mark mark;
  std::string text;
};

void draw_mark(std::ostream& out, const Eigen::Vector2d& centre, legend_mark mark) {
  constexpr double radius = 6;
  const bool of_source = mark == legend_mark::source || mark == legend_mark::only_source;
  const bool hollow = mark == legend_mark::only_target || mark == legend_mark::only_source;
  if (mark == legend_mark::matched) {
    begin_filled(out, halo_colour);
    draw_circle(out, centre, radius + 4);
    end_group(out);
  }
  const std::string_view colour = of_source ? source_colour : target_colour;
  hollow ? begin_hollow(out, colour, 1.5) : begin_filled(out, colour, 0.7);
  draw_circle(out, centre, radius);
  end_group(out);
  if (mark != legend_mark::matched) return;
  begin_filled(out, source_colour, 0.7);
  draw_circle(out, centre, inner_share * radius);
  end_group(out);
}

std::vector<legend_entry> legend_of(const plan_picture& picture) {
  const matched_stems matched = matched_in(picture);
  const auto unmatched = [](const std::vector<bool>& is_matched) {
    return std::to_string(std::count(is_matched.begin(), is_matched.end(), false));
  };
  const auto stems = [](const plan_picture::map& map) {
    return std::to_string(map.positions.size()) + (map.positions.size() == 1 ? " stem" : " stems");
  };
  std::vector<legend_entry> legend = {{legend_mark::target, "target: " + stems(picture.target)},
                                      {legend_mark::source, "source: " + stems(picture.source)}};
  if (!picture.target_from_source) return legend;
  legend.push_back({legend_mark::matched, std::to_string(picture.matches.size()) + " matched"});
  legend.push_back({legend_mark::only_target, unmatched(matched.target) + " only in target"});
  legend.push_back({legend_mark::only_source, unmatched(matched.source) + " only in source"});
  return legend;
}

void draw_legend(std::ostream& out, const plan_picture& picture, double y) {
  const std::vector<legend_entry> legend = legend_of(picture);
  constexpr double step = (page_width - 2 * margin) / 5;
  for (std::size_t i = 0; i < legend.size(); ++i) {
    const double x = margin + 10 + step * static_cast<double>(i);
    draw_mark(out, {x, y}, legend[i].mark);
    draw_text(out, x + 18, y + 5, legend[i].text);
  }
}

std::string note_on_sizes(const page_scale& scale, const plan_picture& picture) {
  if (known_radii(picture).empty()) return "radii not known";
  if (scale.radius_factor > 1) return "stem radii enlarged " + rounded(scale.radius_factor) + " times";
  return "stem radii to scale";
}

}  // namespace

void draw_plan_picture(std::ostream& out, const plan_picture& picture) {
  require_valid(picture);
  const horizontal_points target = horizontal(picture.target.positions);
  const horizontal_points source = horizontal(picture.source.positions);
  const horizontal_points transformed_source = horizontal(
      picture.source.positions, picture.target_from_source.value_or(Eigen::Isometry3d::Identity()));
  const horizontal_points left_target = recentred(target), left_source = recentred(source);
  const box_2d left_box = box_of(left_target).merged(box_of(left_source));
  box_2d right_box = box_of(target);
  if (picture.target_from_source) right_box.extend(box_of(transformed_source));

  const page_scale scale = scale_for(left_box, right_box, picture);
  const std::vector<std::string> caption = wrapped(picture.caption, 150);
  const double bar_y = panel_top + scale.panel_height + 22;
  const double legend_y = bar_y + 34;
  const double caption_y = legend_y + 36;
  const double page_height = caption_y + line_height * static_cast<double>(caption.size());

  out << std::fixed << std::setprecision(2);
  begin_picture(out, page_width, page_height, picture.title, picture.caption);
  draw_text(out, margin, 36, picture.title, {.size = 20, .colour = ink, .weight = "bold"});
  draw_as_they_came(out, picture, scale, left_source, left_target);
  draw_registered(out, picture, scale, transformed_source, target, right_box);
  draw_scale_bar(out, left_panel, bar_y, scale);
  draw_text(out, page_width - margin, bar_y + 5, "x to the right, y up; " + note_on_sizes(scale, picture),
            {.size = 13, .colour = pale_ink, .anchor = "end"});
  draw_legend(out, picture, legend_y);
  for (std::size_t i = 0; i < caption.size(); ++i)
    draw_text(out, margin, caption_y + line_height * static_cast<double>(i), caption[i]);
  end_picture(out);
}

void write_plan_picture(const std::filesystem::path& path, const plan_picture& picture) {
  require_valid(picture);
  atomic_file file(path);
  draw_plan_picture(file.stream(), picture);
  file.commit();
}

}  // namespace globalmatch::support

#include "support/report/section_picture.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <string>
#include <string_view>

#include "support/report/html_parts.hpp"
#include "support/svg_shapes.hpp"

namespace globalmatch::support {

namespace {

constexpr double half_width = 0.2;  // [m] of the section
constexpr double max_length = 30;   // [m] that stems can be seen at on paper
constexpr double beyond_stems = 1;  // [m] at either end
constexpr double section_margin = 24, section_page = 1160, section_head = 60;  // [px]

/// How many of the stems are near the line from one to another, between both.
std::size_t count_along(const std::vector<Eigen::Vector2d>& stems, const Eigen::Vector2d& begin,
                        const Eigen::Vector2d& end) {
  const Eigen::Vector2d along = (end - begin).normalized();
  return std::size_t(std::count_if(stems.begin(), stems.end(), [&](const Eigen::Vector2d& p) {
    const Eigen::Vector2d offset = p - begin;
    const double distance = along.dot(offset);
    return std::abs(along.x() * offset.y() - along.y() * offset.x()) < half_width && distance >= 0 &&
           distance <= (end - begin).norm() + 1e-9;
  }));
}

struct height_range {
  double low = 0, high = 1;

  void include(std::span<const sampled_point> points) {
    for (const sampled_point& p : points)
      low = std::min(low, p.position.z()), high = std::max(high, p.position.z());
  }
};

/// All points as one path of dots.
void draw_dots(std::ostream& out, std::span<const sampled_point> points, std::string_view colour,
               double px_per_metre, double high) {
  out << "<path fill=\"none\" stroke=\"" << colour
      << "\" stroke-width=\"1.6\" stroke-linecap=\"round\" stroke-opacity=\"0.6\" d=\"";
  for (const sampled_point& p : points)
    out << 'M' << section_margin + p.position.x() * px_per_metre << ' '
        << section_head + (high - p.position.z()) * px_per_metre << "h0";
  out << "\"/>\n";
}

}  // namespace

std::optional<vertical_section> section_through(const upright_map& target, const shown_transform& shown) {
  constexpr std::size_t max_tried = 120;  // stems, of which all pairs are tried
  std::vector<Eigen::Vector2d> stems;
  double height = 0;
  for (const auto& [s, t] : shown.matches) {
    if (stems.empty()) height = target.positions[t].z();
    stems.push_back(target.positions[t].head<2>());
  }
  const std::size_t tried = std::min(stems.size(), max_tried);
  std::size_t most = 0;
  Eigen::Vector2d begin, end;
  for (std::size_t i = 0; i < tried; ++i)
    for (std::size_t j = 0; j < tried; ++j) {
      const double length = (stems[j] - stems[i]).norm();
      if (stems[j].x() < stems[i].x() || length < 1e-3 || length > max_length - 2 * beyond_stems) continue;
      const std::size_t count = count_along(stems, stems[i], stems[j]);
      if (count > most) most = count, begin = stems[i], end = stems[j];
    }
  if (most < 2) return std::nullopt;
  const Eigen::Vector2d along = (end - begin).normalized(), start = begin - beyond_stems * along;
  Eigen::Isometry3d upright_from_section = Eigen::Isometry3d::Identity();
  upright_from_section.linear() =
      Eigen::AngleAxisd(std::atan2(along.y(), along.x()), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  upright_from_section.translation() = Eigen::Vector3d(start.x(), start.y(), height);
  return vertical_section{upright_from_section.inverse(), (end - begin).norm() + 2 * beyond_stems,
                          half_width};
}

void draw_section(std::ostream& out, const vertical_section& section, std::span<const sampled_point> source,
                  std::span<const sampled_point> target) {
  height_range range;
  range.include(source);
  range.include(target);
  const double px_per_metre =
      std::min((section_page - 2 * section_margin) / section.length, 700 / (range.high - range.low));
  const double bottom = section_head + (range.high - range.low) * px_per_metre;
  out << std::fixed << std::setprecision(1);
  begin_picture(out, section_page, bottom + 40, "Vertical section through both scans",
                "Points of both scans in a strip through matched stems, seen from the side");
  draw_text(out, section_margin, 28, "Vertical section through matched stems",
            {.size = 16, .weight = "bold"});
  draw_text(out, section_margin, 48,
            rounded_to(1, section.length) + " m long, " + rounded_to(0, 200 * section.half_width) +
                " cm deep; target blue, source orange; heights are not exaggerated",
            {.colour = "#666666"});
  draw_dots(out, target, "#0072B2", px_per_metre, range.high);
  draw_dots(out, source, "#D55E00", px_per_metre, range.high);
  const double right = section_margin + px_per_metre;
  begin_hollow(out, "#222222", 2);
  draw_line(out, {section_margin, bottom + 20}, {right, bottom + 20});
  for (const double x : {section_margin, right}) draw_line(out, {x, bottom + 16}, {x, bottom + 24});
  end_group(out);
  draw_text(out, right + 8, bottom + 25, "1 m");
  end_picture(out);
}

}  // namespace globalmatch::support

#include "support/report/residuals.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>

#include "support/report/html_parts.hpp"
#include "support/svg_shapes.hpp"

namespace globalmatch::support {

namespace {

constexpr double within_95 = 5.991;  // quantile of chi square with two degrees of freedom

constexpr std::string_view inside_colour = "#0072B2", outside_colour = "#D55E00", ink_colour = "#222222";

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// [m^2] of residuals, along each axis, by those of their stems. Mapping knows these to a factor: those far
/// from the usual one are limited, and all are scaled to the residuals, as half of those of Gaussians in the
/// plane lie below 2 ln 2 variances.
std::vector<double> expected_variances(const std::vector<stem_residual>& residuals,
                                       std::vector<double> variances) {
  constexpr double min_variance = 1e-6, limit = 4;
  const double usual = std::max(median_of(variances), min_variance);
  std::vector<double> squares;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    variances[i] = std::clamp(variances[i], usual / limit, usual * limit);
    squares.push_back(residuals[i].residual.head<2>().squaredNorm() / variances[i]);
  }
  const double scale = median_of(squares) / (2 * std::numbers::ln2);
  for (double& variance : variances) variance *= scale;
  return variances;
}

/// How residuals come onto paper; lengths of the page are in px.
struct residual_page {
  static constexpr double margin = 40, top = 60, width = 1160, max_height = 640;
  Eigen::AlignedBox2d box;
  double px_per_metre = 1, enlarged = 1;

  explicit residual_page(const std::vector<stem_residual>& residuals) {
    std::vector<double> sizes;  // [m] of ellipses
    for (const stem_residual& r : residuals) {
      box.extend(Eigen::Vector2d(r.place.head<2>()));
      sizes.push_back(std::sqrt(within_95 * r.expected.trace() / 2));
    }
    const double usual = std::max(median_of(std::move(sizes)), 1e-6);
    const Eigen::Vector2d extent = box.sizes().cwiseMax(1.0);
    px_per_metre = std::min((width - 2 * margin) / extent.x(), (max_height - 2 * margin) / extent.y());
    const double spacing = std::sqrt(extent.prod() / double(residuals.size())) * px_per_metre;
    const double wanted = std::clamp(0.3 * spacing, 6.0, 30.0) / (usual * px_per_metre);
    for (const double factor : {2, 5, 10, 20, 50, 100, 200, 500, 1000})
      if (factor <= wanted) enlarged = factor;
  }
  double height() const { return top + box.sizes().y() * px_per_metre + 3 * margin; }
  Eigen::Vector2d at(const Eigen::Vector3d& p) const {
    return {width / 2 + (p.x() - box.center().x()) * px_per_metre,
            top + margin + (box.max().y() - p.y()) * px_per_metre};
  }
  /// Of a residual [m], which is enlarged.
  Eigen::Vector2d arrow(const Eigen::Vector3d& r) const {
    return Eigen::Vector2d(r.x(), -r.y()) * enlarged * px_per_metre;
  }
};

void draw_ellipse(std::ostream& out, const residual_page& page, const stem_residual& r) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(r.expected);
  const Eigen::Vector2d half =
      (axes.eigenvalues().cwiseMax(0.0) * within_95).cwiseSqrt() * page.enlarged * page.px_per_metre;
  const Eigen::Vector2d along = axes.eigenvectors().col(1);
  const Eigen::Vector2d centre = page.at(r.place);
  out << "<ellipse cx=\"" << centre.x() << "\" cy=\"" << centre.y() << "\" rx=\"" << half.y() << "\" ry=\""
      << half.x() << "\" transform=\"rotate(" << -std::atan2(along.y(), along.x()) * 180 / std::numbers::pi
      << ' ' << centre.x() << ' ' << centre.y() << ")\"/>\n";
}

void draw_arrows(std::ostream& out, const residual_page& page, const std::vector<stem_residual>& residuals,
                 bool are_outside) {
  const std::string_view colour = are_outside ? outside_colour : inside_colour;
  begin_hollow(out, colour, 2);
  for (const stem_residual& r : residuals)
    if ((r.share > 1) == are_outside)
      draw_line(out, page.at(r.place), page.at(r.place) + page.arrow(r.residual));
  end_group(out);
  begin_filled(out, colour);
  for (const stem_residual& r : residuals)
    if ((r.share > 1) == are_outside) draw_circle(out, page.at(r.place) + page.arrow(r.residual), 3);
  end_group(out);
}

/// A bar of one to five times a power of ten of residual.
void draw_bar(std::ostream& out, const residual_page& page, double y) {
  double metres = 0.001;
  for (const double longer : {0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5})
    if (longer * page.enlarged * page.px_per_metre < 160) metres = longer;
  const double right = page.margin + metres * page.enlarged * page.px_per_metre;
  begin_hollow(out, ink_colour, 2);
  draw_line(out, {page.margin, y}, {right, y});
  for (const double x : {page.margin, right}) draw_line(out, {x, y - 4}, {x, y + 4});
  end_group(out);
  draw_text(out, right + 8, y + 5,
            rounded_to(metres < 0.01 ? 1 : 0, 100 * metres) + " cm of residual, enlarged " +
                rounded_to(0, page.enlarged) + " times");
}

}  // namespace

std::vector<stem_residual> residuals_of(const upright_map& source, const upright_map& target,
                                        const shown_transform& shown,
                                        const std::optional<transform_uncertainty>& uncertainty) {
  std::vector<stem_residual> residuals;
  if (!shown.target_from_source || shown.matches.empty()) return residuals;
  const Eigen::Isometry3d transform = target.level * *shown.target_from_source * source.level.inverse();
  std::vector<double> variances;
  for (const auto& [s, t] : shown.matches) {
    const Eigen::Vector3d place = target.positions[t];
    residuals.push_back({s, t, place, transform * source.positions[s] - place});
    variances.push_back(source.variances[s] + target.variances[t]);
  }
  variances = expected_variances(residuals, std::move(variances));
  const Eigen::Matrix3d level = target.level.linear();
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    stem_residual& r = residuals[i];
    r.expected = variances[i] * Eigen::Matrix2d::Identity();
    if (uncertainty) {
      const Eigen::Matrix3d there = uncertainty->at(target.level.inverse() * r.place);
      r.expected += (level * there * level.transpose()).topLeftCorner<2, 2>();
    }
    const Eigen::Vector2d horizontal = r.residual.head<2>();
    if (r.expected.determinant() > 0)
      r.share = std::sqrt(horizontal.dot(r.expected.inverse() * horizontal) / within_95);
  }
  return residuals;
}

void draw_residuals(std::ostream& out, const std::vector<stem_residual>& residuals) {
  const residual_page page(residuals);
  out << std::fixed << std::setprecision(2);
  begin_picture(out, page.width, page.height(), "Residuals of the matched stems in plan",
                "At each matched stem of the target a line to where the source has it, enlarged, in an "
                "ellipse within which 95 % should lie");
  draw_text(out, page.margin, 30, "Residuals of the matched stems, seen from above",
            {.size = 16, .weight = "bold"});
  draw_text(out, page.margin, 52,
            "ellipse: 95 % should lie within; blue: does; orange, with the number of its row: does not",
            {.colour = "#666666"});
  begin_hollow(out, "#999999", 1);
  for (const stem_residual& r : residuals) draw_ellipse(out, page, r);
  end_group(out);
  draw_arrows(out, page, residuals, false);
  draw_arrows(out, page, residuals, true);
  for (std::size_t i = 0; i < residuals.size(); ++i)
    if (residuals[i].share > 1) {
      const Eigen::Vector2d tip = page.at(residuals[i].place) + page.arrow(residuals[i].residual);
      draw_text(out, tip.x() + 5, tip.y() - 4, std::to_string(i + 1), {.size = 12});
    }
  draw_bar(out, page, page.height() - 24);
  end_picture(out);
}

}  // namespace globalmatch::support

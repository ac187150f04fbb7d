#include "support/report/registration_report.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <locale>
#include <sstream>

#include "support/markup.hpp"
#include "support/programs/scan_colours.hpp"
#include "support/report/html_parts.hpp"
#include "support/report/record_sections.hpp"
#include "support/report/report_file.hpp"
#include "support/report/residuals.hpp"
#include "support/report/section_picture.hpp"
#include "support/report/stem_plans.hpp"
#include "support/report/trust.hpp"
#include "support/report/view_3d.hpp"

namespace globalmatch::support {

using json = nlohmann::ordered_json;

namespace {

/// What all sections are about.
struct reported_pair {
  const reported_scan &source, &target;
  const registration& result;
  upright_map upright_source, upright_target;
  std::vector<shown_transform> shown;

  reported_pair(const reported_scan& of_source, const reported_scan& of_target, const registration& r)
      : source(of_source),
        target(of_target),
        result(r),
        upright_source(of_source.map),
        upright_target(of_target.map),
        shown(transforms_to_show(r)) {}

  /// A result, or one of several that might be.
  bool has_places() const { return result.outcome != outcome::not_registered && shown[0].target_from_source; }
};

/// A text that a stream was written to.
template <class Draw>
std::string drawn(const Draw& draw) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  draw(out);
  return out.str();
}

/// One picture of each transform, of which radio buttons show one; no script is needed.
html_section plans_section(const reported_pair& pair) {
  html_section section{"maps", "Stem maps before and after", ""};
  const bool has_choice = pair.shown.size() > 1;
  if (has_choice) section.markup += "<fieldset class=\"choice\"><legend>Transform</legend>\n";
  for (std::size_t i = 0; has_choice && i < pair.shown.size(); ++i) {
    const std::string id = "shown_" + std::to_string(i);
    section.markup += "<input type=\"radio\" name=\"shown\" id=\"" + id + "\" value=\"" + std::to_string(i) +
                      "\"" + (i == 0 ? " checked" : "") + "><label for=\"" + id + "\">" +
                      escaped(pair.shown[i].label) + "</label>\n";
  }
  for (std::size_t i = 0; i < pair.shown.size(); ++i) {
    const shown_transform& shown = pair.shown[i];
    plan_picture picture = picture_of(pair.upright_source, pair.upright_target, shown);
    picture.title = shown.label + ": " +
                    (shown.target_from_source ? counted(shown.matches.size()) + " stems matched"
                                              : std::string("each in its own frame"));
    section.markup += "<div class=\"shown_" + std::to_string(i) + "\">" +
                      figure(drawn([&](std::ostream& out) { draw_plan_picture(out, picture); }),
                             pair.source.name + " (source, orange) on " + pair.target.name +
                                 " (target, blue), seen from above.") +
                      "</div>\n";
  }
  if (has_choice) section.markup += "</fieldset>\n";
  return section;
}

html_section hypotheses_section(const json& report) {
  html_table table("Hypotheses, the best one first",
                   {"rank", "matched stems", "rms [cm]", "within [cm]", "log10 NFA", "evidence"});
  std::size_t rank = 0;
  for (const json& h : report["hypotheses"])
    table.add({number_cell(std::to_string(++rank)), number_cell(counted(h["matches"].get<std::size_t>())),
               number_cell(rounded_to(2, 100 * h["rms"].get<double>())),
               number_cell(rounded_to(1, 100 * h["inlier_threshold"].get<double>())),
               number_cell(rounded_to(1, h["log10_nfa"].get<double>())),
               text_cell(h["evidence_source"].get<std::string>())});
  html_section section{"hypotheses", "Hypotheses", ""};
  section.markup = rank == 0 ? paragraph("No transform was found that pairs stems.")
                             : paragraph((rank == 1 ? "There is no other that the stems speak for. " : "") +
                                         std::string("NFA is the number of false alarms, of transforms "
                                                     "expected to do as well if the scans had nothing in "
                                                     "common: the lower, the better.")) +
                                   table.markup();
  return section;
}

std::string residual_table(const reported_pair& pair, const std::vector<stem_residual>& residuals) {
  html_table table("Residuals of the matched stems",
                   {"no.", "stem of source", "stem of target", "x [m]", "y [m]", "dx [cm]", "dy [cm]",
                    "dz [cm]", "in plan [cm]", "of the ellipse"});
  std::size_t row = 0;
  for (const stem_residual& r : residuals) {
    const auto cm = [](double metres) { return number_cell(rounded_to(1, 100 * metres)); };
    const Eigen::Vector3d& place = pair.target.map.stems[r.target].position;
    table.add({number_cell(std::to_string(++row)), number_cell(std::to_string(r.source)),
               number_cell(std::to_string(r.target)), number_cell(rounded_to(2, place.x())),
               number_cell(rounded_to(2, place.y())), cm(r.residual.x()), cm(r.residual.y()),
               cm(r.residual.z()), cm(r.residual.head<2>().norm()),
               number_cell(rounded_to(2, r.share) + (r.share > 1 ? " outside" : ""))});
  }
  return table.markup();
}

html_section residuals_section(const reported_pair& pair) {
  html_section section{"residuals", "Residuals of the stems", ""};
  const auto residuals =
      residuals_of(pair.upright_source, pair.upright_target, pair.shown[0], pair.result.matching.uncertainty);
  if (residuals.empty()) {
    section.markup = paragraph("No stems are matched.");
    return section;
  }
  std::vector<double> lengths;
  std::size_t outside = 0;
  for (const stem_residual& r : residuals) {
    lengths.push_back(r.residual.head<2>().norm());
    outside += r.share > 1;
  }
  std::sort(lengths.begin(), lengths.end());
  section.markup =
      (pair.result.target_from_source ? "" : paragraph("Of the best hypothesis, which is no result.")) +
      paragraph("Half of the " + counted(residuals.size()) + " pairs are closer in plan than " +
                as_length(lengths[lengths.size() / 2]) + ", all are closer than " +
                as_length(lengths.back()) + "; " + counted(outside) +
                " lie outside of the ellipse that 95 % should lie in.") +
      figure(drawn([&](std::ostream& out) { draw_residuals(out, residuals); }),
             "Where a residual leaves its ellipse, the stem leans, was mapped badly, or is no pair.") +
      folded("All residuals", residual_table(pair, residuals));
  return section;
}

html_section evidence_section(const json& report) {
  return {"evidence", "From points to matched stems",
          funnel_table("Source: points to stems", report["source"]["funnel"]) +
              funnel_table("Target: points to stems", report["target"]["funnel"]) +
              funnel_table("Stems to matched stems", report["funnel"])};
}

/// The transform, as the JSON has it.
html_section numbers_section(const json& report) {
  html_section section{"transform", "Transform from source to target", ""};
  if (report["target_from_source"].is_null()) {
    section.markup = paragraph("None.");
    return section;
  }
  std::string rows;
  for (std::size_t i = 0; i < 16; ++i)
    rows += report["target_from_source"][i].dump() + (i % 4 == 3 ? "\n" : " ");
  section.markup = "<pre tabindex=\"0\">" + rows + "</pre>\n";
  return section;
}

std::vector<std::string> warning_lines(const reported_pair& pair, const json& report) {
  std::vector<std::string> lines;
  const auto add = [&](const std::string& of, const json& warnings) {
    for (const json& w : warnings) lines.push_back(of + w["text"].get<std::string>() + ".");
  };
  add("", report["warnings"]);
  add(pair.source.name + ": ", report["source"]["warnings"]);
  add(pair.target.name + ": ", report["target"]["warnings"]);
  return lines;
}

/// Points in space, and the section through them where there is a result.
void add_points(html_page& page, const reported_pair& pair) {
  constexpr std::size_t max_points = 100000;  // a scan
  const bool is_registered = pair.result.target_from_source.has_value();
  if (!pair.has_places()) {
    page.without_view = "There is none, because nothing places the scans beside each other.";
    return;
  }
  if (!has_view_3d()) page.without_view = no_view_3d;
  const std::size_t wanted = has_view_3d() ? max_points : 0;
  std::optional<vertical_section> across;
  if (is_registered) across = section_through(pair.upright_target, pair.shown[0]);
  if (wanted == 0 && !across) return;
  const Eigen::Isometry3d& level = pair.upright_target.level;
  const auto sampled = [&](const reported_scan& of, const Eigen::Isometry3d& upright_from_scan) {
    std::optional<vertical_section> section = across;
    if (section) section->section_from_scan = across->section_from_scan * upright_from_scan;
    return sample_of(of.scan, of.map.terrain, wanted, section);
  };
  scan_sample target = sampled(pair.target, level);
  scan_sample source = sampled(pair.source, level * *pair.shown[0].target_from_source);
  if (across)
    page.sections.insert(
        page.sections.begin() + 1,
        {"section", "Vertical section",
         figure(drawn([&](std::ostream& out) { draw_section(out, *across, source.section, target.section); }),
                "Stems and ground of both scans must coincide, each scan seeing its side.")});
  if (wanted == 0) return;
  std::vector<view_placement> placements;
  for (const shown_transform& shown : pair.shown)
    placements.push_back({shown.label, {level, level * *shown.target_from_source}});
  const view_scan scans[] = {{pair.target.name, target_scan_colour, std::move(target.understory)},
                             {pair.source.name, source_scan_colour, std::move(source.understory)}};
  page.view = describe_view(scans, placements);
}

}  // namespace

std::pair<std::string, std::string> names_apart(const std::filesystem::path& a,
                                                const std::filesystem::path& b) {
  const auto with_folder = [](const std::filesystem::path& file) {
    return (file.parent_path().filename() / file.filename()).generic_string();
  };
  if (a.filename() == b.filename()) return {with_folder(a), with_folder(b)};
  return {a.filename().string(), b.filename().string()};
}

void write_registration_report(const std::filesystem::path& path, const reported_scan& source,
                               const reported_scan& target, const registration& result, bool needs_height,
                               const json& report) {
  const std::string title = source.name + " on " + target.name;
  if (report_format_of(path) == report_format::svg) {
    write_stem_plan(path, source.map, target.map, result, title);
    return;
  }
  const reported_pair pair(source, target, result);
  html_page page;
  page.title = "Registration of " + title;
  page.trust = trust_in(result, needs_height);
  page.sections = {plans_section(pair),        residuals_section(pair),
                   hypotheses_section(report), warnings_section(warning_lines(pair, report)),
                   numbers_section(report),    evidence_section(report),
                   times_section(report),      record_section(report)};
  page.made_by = made_by("register_scans", report);
  add_points(page, pair);
  write_html_page(path, page);
}

}  // namespace globalmatch::support

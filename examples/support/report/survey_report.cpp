#include "support/report/survey_report.hpp"

#include <algorithm>
#include <cmath>
#include <locale>
#include <memory>
#include <numbers>
#include <sstream>

#include "support/programs/scan_colours.hpp"
#include "support/programs/survey_maps.hpp"
#include "support/programs/survey_picture.hpp"
#include "support/report/html_parts.hpp"
#include "support/report/record_sections.hpp"
#include "support/report/report_file.hpp"
#include "support/report/trust.hpp"
#include "support/report/view_3d.hpp"
#include "support/scan_sample.hpp"
#include "support/scans_on_demand.hpp"

namespace globalmatch::support {

using json = nlohmann::ordered_json;

namespace {

html_cell cell_of_cm(double metres, int digits = 1) {
  return number_cell(std::isfinite(metres) ? rounded_to(digits, 100 * metres) : "");
}

std::vector<survey_row> by_name(std::vector<survey_row> rows) {
  std::sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return rows;
}

/// Standard deviations of a pose; empty where they are not known.
std::vector<html_cell> cells_of_errors(const survey::scan& scan) {
  if (!scan.uncertainty) return {text_cell(""), text_cell(""), text_cell("")};
  const transform_uncertainty& u = *scan.uncertainty;
  const double upwards = u.up.dot(u.at(u.center) * u.up);
  return {cell_of_cm(horizontal_error(u, u.center), 2),
          scan.is_height_known ? cell_of_cm(std::sqrt(std::max(0.0, upwards)), 2) : text_cell("not known"),
          number_cell(rounded_to(3, std::sqrt(u.covariance(3, 3)) * 180 / std::numbers::pi))};
}

html_section plan_section(const survey_work& work, const survey& result) {
  std::ostringstream picture;
  picture.imbue(std::locale::classic());
  draw_survey_picture(picture, work.rows, result);
  return {
      "plan", "Scans and links",
      figure(picture.str(), "Component 1, that of most scans, seen from above; the others are named below.")};
}

html_section missing_section(const survey_work& work, const survey& result) {
  html_section section{"missing", "Scans without a place in the common frame", ""};
  html_table table("Scans without a place, and why", {"scan", "status", "reason"});
  bool has_any = false;
  for (const survey_row& row : by_name(work.rows)) {
    if (row.scan && result.scans[*row.scan].component == 0) continue;
    has_any = true;
    table.add({text_cell(row.name), text_cell(in_words(row.status)), text_cell(row.reason)});
  }
  section.markup = has_any ? table.markup() : paragraph("None: all scans are placed.");
  return section;
}

html_section scans_section(const survey_work& work, const survey& result) {
  const std::string reference = reference_of(result, work.names);
  html_table table("Scans, their expected errors, and how far their stems are from the trees of the others",
                   {"scan", "status", "component", "links", "in plan [cm]", "height [cm]", "turn [deg]",
                    "check, median [cm]", "check, worst [cm]"});
  for (const survey_row& row : by_name(work.rows)) {
    if (!row.scan || result.scans[*row.scan].component < 0) continue;
    const survey::scan& scan = result.scans[*row.scan];
    const bool is_reference = row.name == reference;
    std::vector<html_cell> cells = {
        text_cell(row.name), text_cell(is_reference ? "the reference" : in_words(row.status)),
        number_cell(std::to_string(scan.component + 1)), number_cell(counted(scan.links))};
    for (html_cell& cell : cells_of_errors(scan)) cells.push_back(std::move(cell));
    cells.push_back(cell_of_cm(scan.check_median));
    cells.push_back(cell_of_cm(scan.check_worst));
    table.add(cells);
  }
  return {"scans", "Agreement by scan",
          paragraph((reference.empty() ? "Errors are standard errors in the frame that is given. "
                                       : "Errors are standard errors against the reference, " + reference +
                                             ", which has none by definition. ") +
                    "The check places each half of a scan's "
                    "stems by the other half, so that no stem had a say in its own place; it needs eight "
                    "shared stems.") +
              table.markup()};
}

/// As poses.csv has them.
html_section poses_section(const survey_work& work, const survey& result) {
  html_table table("Poses: survey from scan, p_survey = R(q) p + t",
                   {"scan", "component", "tx [m]", "ty [m]", "tz [m]", "qx", "qy", "qz", "qw"});
  for (const survey_row& row : by_name(work.rows)) {
    if (!row.scan || result.scans[*row.scan].component < 0) continue;
    const survey::scan& scan = result.scans[*row.scan];
    const Eigen::Vector3d t = scan.survey_from_scan.translation();
    Eigen::Quaterniond q(scan.survey_from_scan.linear());
    if (q.w() < 0) q.coeffs() *= -1;
    std::vector<html_cell> cells = {text_cell(row.name), number_cell(std::to_string(scan.component + 1))};
    for (const double metres : {t.x(), t.y(), t.z()}) cells.push_back(number_cell(rounded_to(4, metres)));
    for (const double part : {q.x(), q.y(), q.z(), q.w()}) cells.push_back(number_cell(rounded_to(8, part)));
    table.add(cells);
  }
  return {
      "poses", "Poses",
      paragraph("Files have them with all digits: poses.csv, and a matrix of each scan in T_NAME.txt. They "
                "count components from 0.") +
          folded("All poses", table.markup())};
}

html_section links_section(const survey_work& work, const survey& result) {
  html_table table("Links between scans",
                   {"source", "target", "stems", "rms [cm]", "off the adjusted poses [cm]",
                    "closure of cycles [cm]", "cycles that close", "log10 NFA", "used"});
  std::size_t used = 0, in_cycles = 0;
  for (const survey::link& l : result.links) {
    used += l.used;
    in_cycles += l.used && l.supporting_cycles > 0;
    table.add({text_cell(work.names[l.source]), text_cell(work.names[l.target]),
               number_cell(counted(l.correspondences)), cell_of_cm(l.rms),
               l.used ? cell_of_cm(l.residual) : text_cell(""), cell_of_cm(l.closure),
               number_cell(counted(l.supporting_cycles)),
               number_cell(std::isfinite(l.log10_nfa) ? rounded_to(1, l.log10_nfa) : ""),
               text_cell(l.used ? "yes" : "no")});
  }
  return {
      "links", "Links and cycles",
      paragraph(
          counted(used) + " of " + counted(result.links.size()) + " links are used; " + counted(in_cycles) +
          " of these are in a cycle of three that closes. NFA is the number of false alarms: links as good "
          "that are expected of scans with nothing in common.") +
          folded("All links", table.markup())};
}

std::vector<std::string> warning_lines_of(const json& report) {
  std::vector<std::string> lines;
  for (const json& w : report["warnings"])
    lines.push_back(w["scan"].get<std::string>() + ": " + w["text"].get<std::string>() + ".");
  return lines;
}

/// Points of the scans of the largest component, fewer of each the more there are.
void add_view(html_page& page, const survey_command& command, const survey_work& work, const survey& result) {
  constexpr std::size_t max_points = 300000;  // of all scans
  const auto count =
      std::count_if(result.scans.begin(), result.scans.end(), [](const auto& s) { return s.component == 0; });
  if (command.scans.empty())
    page.without_view = "There is none, because stem maps alone hold no points.";
  else if (count < 2)
    page.without_view = "There is none, because no scans are placed beside each other.";
  else if (!has_view_3d())
    page.without_view = no_view_3d;
  if (!page.without_view.empty()) return;
  const auto opener = std::make_shared<scan_opener>(command.options.for_reading());
  const survey_mapper maps(command.out_dir / "maps", command.options, true);
  std::vector<view_scan> scans;
  view_placement placement{"Survey", {}};
  for (const survey_row& row : by_name(work.rows)) {
    if (!row.scan || result.scans[*row.scan].component != 0) continue;
    const std::size_t m = *row.scan;
    const scan_file scan = open_on_demand(work.kept[m].path, opener);
    const stem_map map = maps.with_samples(work.names[m]);
    scans.push_back({work.names[m], scan_colour_of(scans.size()),
                     sample_of(scan, map.terrain, max_points / std::size_t(count), std::nullopt).understory});
    placement.view_from_scan.push_back(result.scans[m].survey_from_scan);
  }
  page.view = describe_view(scans, {&placement, 1});
}

}  // namespace

void write_survey_report(const survey_command& command, const survey_work& work, const survey& result,
                         const json& report) {
  if (command.picture.empty()) return;
  if (report_format_of(command.picture) == report_format::svg) {
    write_survey_picture(command.picture, work.rows, result);
    return;
  }
  html_page page;
  page.title = "Survey of " + counted(work.rows.size()) + " scans";
  page.trust = trust_in(work.rows, result);
  page.sections = {plan_section(work, result),  missing_section(work, result),
                   scans_section(work, result), links_section(work, result),
                   poses_section(work, result), warnings_section(warning_lines_of(report)),
                   times_section(report),       record_section(report)};
  page.made_by = made_by("register_survey", report);
  add_view(page, command, work, result);
  write_html_page(command.picture, page);
}

}  // namespace globalmatch::support

#include "support/report/record_sections.hpp"

#include <algorithm>

#include "support/report/html_parts.hpp"

namespace globalmatch::support {

using json = nlohmann::ordered_json;

namespace {

/// As people write it: text without quotes, lists with blanks, nothing for null.
std::string plain(const json& value) {
  if (value.is_null()) return "";
  if (value.is_string()) return value.get<std::string>();
  if (!value.is_array()) return value.dump(-1, ' ', false, json::error_handler_t::replace);
  std::string list;
  for (const json& item : value) list += (list.empty() ? "" : " ") + plain(item);
  return list;
}

}  // namespace

std::string funnel_table(std::string_view caption, const json& funnel) {
  html_table table(caption, {"step", "given", "", "left", "", "the rest was"});
  for (const json& step : funnel) {
    const auto in = step["input_count"].get<std::size_t>(), out = step["output_count"].get<std::size_t>();
    table.add({text_cell(plain(step["step"])), number_cell(counted(in)), text_cell(plain(step["input"])),
               number_cell(counted(out)), text_cell(plain(step["output"])),
               prose_cell(plain(step["dropped_because"]))});
  }
  return table.markup();
}

html_section times_section(const json& report) {
  const double total = report.value("seconds", 0.0);
  html_table table("Times by stage", {"stage", "seconds", ""});
  for (const auto& [stage, seconds] : report["stages"].items())
    table.add({text_cell(stage), number_cell(rounded_to(2, seconds.get<double>())),
               bar_cell(total > 0 ? seconds.get<double>() / total : 0)});
  table.add({text_cell("all"), number_cell(rounded_to(2, total)), text_cell("")});
  return {"times", "Times", table.markup()};
}

html_section warnings_section(const std::vector<std::string>& lines) {
  return {"warnings", "Warnings", lines.empty() ? paragraph("None.") : bullet_list(lines)};
}

html_section record_section(const json& report) {
  html_table build("Build", {"of", "value"});
  for (const auto& [name, value] : report["globalmatch"].items())
    build.add({text_cell(name), text_cell(plain(value))});
  html_table options("Options, also those that were not given", {"option", "value"});
  for (const auto& [name, value] : report["options"].items())
    options.add({text_cell(name), text_cell(plain(value))});
  html_section section{"record", "Record of the run", "<pre tabindex=\"0\">"};
  section.markup += text_cell(plain(report["command"])).markup + "</pre>\n" + build.markup() +
                    folded("Options", options.markup());
  return section;
}

std::string made_by(std::string_view program, const json& report) {
  return "Made by " + std::string(program) + " of globalmatch " + plain(report["globalmatch"]["version"]) +
         (report["globalmatch"]["commit"].is_null() ? ""
                                                    : ", commit " + plain(report["globalmatch"]["commit"])) +
         ".";
}

}  // namespace globalmatch::support

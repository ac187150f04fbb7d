// Sections of a report that are made of what a program records in JSON.
#pragma once

#include <nlohmann/json.hpp>

#include <string>
#include <string_view>
#include <vector>

#include "support/report/html_page.hpp"

namespace globalmatch::support {

/// A funnel of counts as a table: what each step was given and left.
std::string funnel_table(std::string_view caption, const nlohmann::ordered_json& funnel);

/// Times by stage.
html_section times_section(const nlohmann::ordered_json& report);

/// Warnings, a line each; says so where there are none.
html_section warnings_section(const std::vector<std::string>& lines);

/// Command, options and build.
html_section record_section(const nlohmann::ordered_json& report);

/// The program and its version.
std::string made_by(std::string_view program, const nlohmann::ordered_json& report);

}  // namespace globalmatch::support

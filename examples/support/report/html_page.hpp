// A report as one HTML file that needs no other.
#pragma once

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <vector>

#include "support/report/trust.hpp"

namespace globalmatch::support {

struct html_section {
  std::string id, heading, markup;
};

struct html_page {
  std::string title;
  trust_statement trust;
  std::vector<html_section> sections;
  nlohmann::ordered_json view =
      nullptr;               ///< what the 3-D view shows, see `view_3d.hpp`; null: it is left out
  std::string without_view;  ///< why
  std::string made_by;       ///< the program and its version
};

/// Whether this build has a 3-D view.
bool has_view_3d();
/// What a page says in its place.
inline constexpr std::string_view no_view_3d =
    "This build has none. Where npm is installed, `cmake -S . -B build/release -DGLOBALMATCH_REPORT_3D=ON` "
    "and then `cmake --build build/release` make programs whose reports have it.";

/// Writes the page whole or not at all. All is in it: style, pictures, points and the script of the view,
/// which is the only one; it asks for nothing from a network. Throws `file_error`.
void write_html_page(const std::filesystem::path& path, const html_page& page);

}  // namespace globalmatch::support

#include "support/programs/scan_reports.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <sstream>

#include "support/class_counts.hpp"

namespace globalmatch::support {

namespace {

using nlohmann::ordered_json;

ordered_json to_json(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

template <class Counts>
ordered_json to_json(const Counts& counts) {
  ordered_json by_number;
  for (std::size_t i = 0; i < counts.size(); ++i)
    if (counts[i] > 0) by_number[std::to_string(i)] = counts[i];
  return by_number;
}

std::string in_metres(double length) {
  std::ostringstream text;
  text << std::round(10 * length) / 10;
  return text.str();
}

// "returns 1: 83 %, 2: 16 %, 3: 1 %"; of many numbers the first ones.
template <class Counts>
void put_shares(std::ostream& out, const char* name, const Counts& counts) {
  constexpr std::size_t max_shown = 6;
  const auto sum = double(std::accumulate(counts.begin(), counts.end(), std::size_t(0)));
  std::size_t shown = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] == 0) continue;
    if (++shown > max_shown) continue;
    const long long percent = std::llround(100 * double(counts[i]) / sum);
    out << (shown == 1 ? name : ", ") << i << ": ";
    percent > 0 ? out << percent << " %" : out << "< 1 %";
  }
  if (shown > max_shown) out << " and " << shown - max_shown << " more";
}

}  // namespace

std::string one_line(const scan_header& header, const scan_summary& summary) {
  std::ostringstream text;
  text << header.format << ", " << summary.points << " points";
  if (summary.points > 0) {
    const Eigen::Vector3d size = summary.extent.sizes();
    text << ", " << in_metres(size.x()) << " x " << in_metres(size.y()) << " x " << in_metres(size.z())
         << " m";
  }
  for (std::size_t r = 0; summary.density && r < summary.density->size(); ++r)
    text << (r == 0 ? ", " : "/") << std::llround((*summary.density)[r]);
  text << (summary.density ? " points/m2 at 5/10/20 m"
                           : ", no density: the scanner is elsewhere (--scanner)");
  for (std::size_t a = 0; a < header.attributes.size(); ++a)
    text << (a == 0 ? " (" : ", ") << header.attributes[a];
  if (!header.attributes.empty()) text << ')';
  if (summary.classes) {
    put_shares(text, ", returns ", summary.classes->return_numbers);
    put_shares(text, ", classes ", summary.classes->classes);
  }
  if (header.pose) text << ", pose in the header";
  return text.str();
}

ordered_json describe(const scan_header& header, const scan_summary& summary) {
  ordered_json report = {{"format", header.format}, {"points", summary.points}};
  if (summary.points > 0)
    report["extent"] = {{"min", to_json(summary.extent.min())}, {"max", to_json(summary.extent.max())}};
  else
    report["extent"] = nullptr;
  report["density"] = {{"distance", scan_summary::distances}, {"points_per_m2", nullptr}};
  if (summary.density) report["density"]["points_per_m2"] = *summary.density;
  report["attributes"] = header.attributes;
  const class_counts counts = summary.classes.value_or(class_counts{});
  report["returns"] = to_json(counts.return_numbers);
  report["returns_of_pulse"] = to_json(counts.return_counts);
  report["classes"] = to_json(counts.classes);
  if (header.pose)
    for (int i = 0; i < 16; ++i) report["survey_from_file"].push_back(header.pose->matrix()(i / 4, i % 4));
  else
    report["survey_from_file"] = nullptr;
  return report;
}

}  // namespace globalmatch::support

#include "support/programs/survey_targets.hpp"

#include <cmath>
#include <iostream>
#include <set>
#include <utility>

#include "support/programs/named_table.hpp"

namespace globalmatch::support {

using nlohmann::ordered_json;

namespace {

named_target target_of(const named_row& row) {
  named_target target;
  target.scan = row.text("scan");
  survey_options::target& t = target.measured;
  t.name = row.text("target");
  if (t.name.empty()) row.fail("the target has no name");
  t.position = {row.number("x"), row.number("y"), row.number("z")};
  if (!t.position.allFinite()) row.fail("x, y and z of a target are needed");
  if (!row.text("sigma").empty()) t.sigma = row.sigma("sigma", true);
  return target;
}

/// A number, or nothing where it is not finite.
ordered_json known(double number) {
  return std::isfinite(number) ? ordered_json(number) : ordered_json();
}

}  // namespace

std::vector<named_target> read_targets(const std::filesystem::path& file) {
  std::vector<named_target> targets;
  std::set<std::pair<std::string, std::string>> seen;
  for (const named_row& row : read_named_table(file, {"scan", "target", "x", "y", "z", "sigma"})) {
    targets.push_back(target_of(row));
    const named_target& t = targets.back();
    if (!seen.emplace(t.scan, t.measured.name).second)
      row.fail(t.scan + " has target " + t.measured.name + " twice",
               "Leave out the worse one, or give each point a name of its own.");
  }
  return targets;
}

std::vector<survey_options::target> targets_of(const std::vector<named_target>& targets,
                                               const survey_work& work) {
  std::vector<survey_options::target> known;
  std::set<std::string> unknown;
  for (const named_target& t : targets) {
    if (const auto scan = work.index_of(t.scan); scan && scan != work.control) {
      known.push_back(t.measured);
      known.back().scan = *scan;
    } else {
      unknown.insert(t.scan);
    }
  }
  for (const std::string& name : unknown)
    std::cerr << name << ": no scan of that name was mapped; its targets are left out\n";
  return known;
}

void report_targets(const survey& result, const std::vector<std::string>& names) {
  constexpr double min_weight = 0.01;
  for (const survey::target& t : result.targets)
    for (const survey::target_observation& o : t.seen) {
      const bool fits =
          o.weight > min_weight && (o.height_weight > min_weight || !result.scans[o.scan].is_height_known);
      if (fits || !(o.residual > 0)) continue;
      if (t.seen.size() == 2) {
        std::cerr << "target " << t.name << ": " << names[t.seen[0].scan] << " and " << names[t.seen[1].scan]
                  << " have it " << o.residual << " m apart; it has no weight\n";
        break;
      }
      std::cerr << "target " << t.name << ": " << names[o.scan] << " has it " << o.residual
                << " m from where the others have it; it has no weight there\n";
    }
}

ordered_json describe_targets(const survey& result, const std::vector<std::string>& names) {
  auto targets = ordered_json::array();
  for (const survey::target& t : result.targets) {
    auto seen = ordered_json::array();
    for (const survey::target_observation& o : t.seen)
      seen.push_back({{"scan", names[o.scan]},
                      {"sigma", o.sigma},
                      {"residual", known(o.residual)},
                      {"weight", o.weight},
                      {"height_weight", o.height_weight}});
    targets.push_back({{"target", t.name},
                       {"component", t.component},
                       {"position", {t.position.x(), t.position.y(), t.position.z()}},
                       {"sigma_plan", t.sigma},
                       {"sigma_height", known(t.height_sigma)},
                       {"seen", std::move(seen)}});
  }
  return targets;
}

}  // namespace globalmatch::support

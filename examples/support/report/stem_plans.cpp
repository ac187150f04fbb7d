#include "support/report/stem_plans.hpp"

#include <algorithm>

#include "support/programs/reports.hpp"

namespace globalmatch::support {

namespace {

std::vector<std::pair<stem_index, stem_index>> pairs_of(const hypothesis& h) {
  std::vector<std::pair<stem_index, stem_index>> pairs;
  for (const correspondence& c : h.correspondences) pairs.emplace_back(c.source, c.target);
  return pairs;
}

}  // namespace

Eigen::Isometry3d levelling(const Eigen::Vector3d& up) {
  Eigen::Isometry3d level = Eigen::Isometry3d::Identity();
  level.linear() = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return level;
}

std::vector<shown_transform> transforms_to_show(const registration& result) {
  constexpr std::size_t max_shown = 6;
  const auto& hypotheses = result.matching.hypotheses;
  std::vector<shown_transform> shown;
  if (result.target_from_source)
    shown.push_back({"Result", result.target_from_source, pairs_of(hypotheses.front())});
  const std::size_t first = shown.size();
  const std::string name = result.target_from_source ? "Alternative " : "Hypothesis ";
  for (std::size_t i = first; i < std::min(hypotheses.size(), max_shown); ++i)
    shown.push_back(
        {name + std::to_string(i + 1 - first), hypotheses[i].target_from_source, pairs_of(hypotheses[i])});
  if (shown.empty()) shown.push_back({"Stem maps", std::nullopt, {}});
  return shown;
}

upright_map::upright_map(const stem_map& map) : level(levelling(map.up)) {
  for (const stem& s : map.stems) {
    positions.push_back(level * s.position);
    radii.push_back(s.radius);
    variances.push_back(s.position_sigma * s.position_sigma);
  }
}

plan_picture picture_of(const upright_map& source, const upright_map& target, const shown_transform& shown) {
  plan_picture picture{.source = {source.positions, source.radii},
                       .target = {target.positions, target.radii}};
  if (!shown.target_from_source) return picture;
  picture.target_from_source = target.level * *shown.target_from_source * source.level.inverse();
  picture.matches = shown.matches;
  return picture;
}

void write_stem_plan(const std::filesystem::path& path, const stem_map& source, const stem_map& target,
                     const registration& result, std::string_view title) {
  const upright_map upright_source(source), upright_target(target);
  shown_transform shown;
  if (result.target_from_source) shown = transforms_to_show(result).front();
  plan_picture picture = picture_of(upright_source, upright_target, shown);
  picture.title = title;
  picture.caption = summary(result.matching);
  write_plan_picture(path, picture);
}

}  // namespace globalmatch::support

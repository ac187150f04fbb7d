// What is surveyed: stands that were measured or made up, and maps from elsewhere among theirs.
#pragma once

#include "fitted_stand.hpp"
#include "stem_layouts.hpp"
#include "support/file_error.hpp"
#include "support/stem_files.hpp"
#include "survey_layouts.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

struct scene_options {
  /// "bigwoods", "plantation_utas": measured; "fitted": like bigwoods; others as in `plant`.
  std::string layout = "fitted";
  std::size_t maps = 200, aliens = 10;
  std::filesystem::path data = "../shared/data/stem_maps";
  stand_options stand = {};
  survey_layout survey = {};
};

/// Stems of a file; on rolling ground where it has no heights.
inline positions measured_stems(const std::filesystem::path& file, const relief& ground) {
  const support::stem_table table = support::read_stems(file);
  const bool is_flat = std::all_of(table.stems.begin(), table.stems.end(),
                                   [&](const auto& s) { return s.z == table.stems.front().z; });
  positions stems;
  for (const support::stem_record& s : table.stems)
    stems.push_back({s.x, s.y, is_flat ? ground(s.x, s.y) : s.z});
  return stems;
}

/// Stems of a file with the columns x,y,z,dbh,site: those of each site.
inline std::vector<positions> stems_of_sites(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  if (!line.starts_with("x,y,z,dbh,site"))
    throw support::file_error(file, "not a table of x,y,z,dbh,site", "Name the folder by --data");
  std::map<std::string, positions> sites;
  while (std::getline(in, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream fields(line);
    Eigen::Vector3d p;
    std::string diameter, site;
    if (fields >> p.x() >> p.y() >> p.z() >> diameter >> site) sites[site].push_back(p);
  }
  std::vector<positions> all;
  for (auto& [site, stems] : sites) all.push_back(std::move(stems));
  return all;
}

/// Makes surveys; reads each file once.
class survey_scenes {
 public:
  explicit survey_scenes(scene_options options)
      : options_(std::move(options)),
        bigwoods_(measured_stems(options_.data / "bigwoods_dbh10cm.csv", options_.stand.ground)),
        fitted_(correlation_of(bigwoods_)) {}

  const fitted_stand& fitted() const { return fitted_; }

  /// Maps of a stand and aliens, in no order. Aliens are stands 0 < number; half of them as the stand, or
  /// like bigwoods where that was measured, the others from the files of clustered and boreal stands, as far
  /// as these go.
  std::vector<surveyed_map> make(std::size_t maps, random_source& random) const {
    const double side = options_.survey.spacing * std::ceil(std::sqrt(double(maps)));
    std::vector<surveyed_map> all = survey_stand(stand_of(side, random), options_.survey, maps, random);
    std::vector<surveyed_map> aliens = measured_aliens(random);
    for (std::size_t a = 0; a < options_.aliens; ++a) {
      if (a % 2 == 0 || aliens.empty()) {
        all.push_back(alien_like_stand(random));
      } else {
        all.push_back(std::move(aliens.back()));
        aliens.pop_back();
      }
      all.back().stand = int(a) + 1;
    }
    shuffle(all, random);
    return all;
  }

 private:
  template <class T>
  static void shuffle(std::vector<T>& values, random_source& random) {
    for (std::size_t i = values.size(); i > 1; --i)
      std::swap(values[i - 1], values[random.below(std::uint32_t(i))]);
  }

  positions stand_of(double side, random_source& random) const {
    if (options_.layout == "bigwoods") return bigwoods_;
    if (options_.layout == "plantation_utas")
      return measured_stems(options_.data / "plantation_utas.csv", options_.stand.ground);
    return made_up(side, random);
  }
  positions made_up(double side, random_source& random) const {
    if (options_.layout == "fitted" || options_.layout == "bigwoods" || options_.layout == "plantation_utas")
      return fitted_.plant(side, side, random, options_.stand.ground);
    return plant(options_.layout, side, side, random, options_.stand);
  }

  surveyed_map alien_like_stand(random_source& random) const {
    const double side = 2.5 * options_.survey.max_range;
    return seen_from_middle(made_up(side, random), random);
  }
  surveyed_map seen_from_middle(const positions& trees, random_source& random) const {
    const bounds around(trees);
    return survey_from(trees, tree_cells(trees, options_.survey.max_range), (around.low + around.high) / 2,
                       options_.survey, random);
  }

  /// Maps of the clustered stand that have no tree in common, and of the boreal sites.
  std::vector<surveyed_map> measured_aliens(random_source& random) const {
    if (options_.aliens < 2) return {};
    const positions clustered = measured_stems(options_.data / "clustered_bei.csv", options_.stand.ground);
    survey_layout apart = options_.survey;
    apart.spacing = 2 * (options_.survey.max_range + options_.survey.offset);
    std::vector<surveyed_map> aliens = survey_stand(clustered, apart, clustered.size(), random);
    for (const positions& site : stems_of_sites(options_.data / "boreal_48_sites.csv"))
      aliens.push_back(seen_from_middle(site, random));
    shuffle(aliens, random);
    return aliens;
  }

  scene_options options_;
  positions bigwoods_;
  fitted_stand fitted_;
};

/// Stems in common of maps, as [map] -> (other map, stems) for those that have some.
inline std::vector<std::vector<std::pair<std::size_t, std::size_t>>> stems_in_common(
    const std::vector<surveyed_map>& maps) {
  std::map<std::pair<int, std::size_t>, std::vector<std::size_t>> seen_by;  // of each stand's tree
  for (std::size_t m = 0; m < maps.size(); ++m)
    for (const std::size_t t : maps[m].trees)
      if (t != no_tree) seen_by[{maps[m].stand, t}].push_back(m);
  std::vector<std::vector<std::pair<std::size_t, std::size_t>>> common(maps.size());
  std::vector<std::size_t> count(maps.size());
  for (std::size_t m = 0; m < maps.size(); ++m) {
    std::vector<std::size_t> others;
    for (const std::size_t t : maps[m].trees)
      if (t != no_tree)
        for (const std::size_t other : seen_by[{maps[m].stand, t}])
          if (other != m && count[other]++ == 0) others.push_back(other);
    for (const std::size_t other : others) {
      common[m].emplace_back(other, count[other]);
      count[other] = 0;
    }
  }
  return common;
}

}  // namespace globalmatch::benchmarks

// Which maps of a survey may overlap. In: stem maps. Out: for each map the transforms in plan that congruent
// triangles of others vote for. One index over the triangles of all maps, so that no pair of maps is looked
// at that has none in common. Ours; after the votes of a generalised Hough transform (Ballard 1981, Pattern
// Recognition 13(2)).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "globalmatch/detail/core/growing_grid.hpp"
#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/neighbor.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/core/wrapped_grid.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/triangles.hpp"

namespace globalmatch::detail {

/// A transform between two maps that some triangles agree on.
struct overlap_candidate {
  std::uint32_t source = 0, target = 0;
  std::uint32_t votes = 0;            ///< congruent triangles that agree on it
  std::vector<correspondence> pairs;  ///< their vertices, of some of them
};

/// The triangles that each stem makes with two of its nearest, each once.
inline std::vector<triangle> local_triangles(const prepared_stems& map, std::size_t neighbors) {
  std::vector<keyed> triplets;
  const std::vector<stem_index> nearest = nearest_stems(*map.index, neighbors);
  const std::size_t size = map.stems.size(), count = size == 0 ? 0 : nearest.size() / size;
  for (std::size_t i = 0; i < size; ++i)
    for (std::size_t j = 0; j < count; ++j)
      for (std::size_t k = j + 1; k < count; ++k) {
        std::array<stem_index, 3> v = {stem_index(i), nearest[i * count + j], nearest[i * count + k]};
        std::sort(v.begin(), v.end());
        triplets.push_back({key_of(v[0], v[1]), v[2]});
      }
  keep_distinct(triplets);
  std::vector<triangle> triangles;
  triangles.reserve(triplets.size());
  for (const keyed& t : triplets)
    triangles.push_back(
        make_triangle(map.stems, {first_of(t.key), second_of(t.key), stem_index(t.value)}, true));
  return triangles;
}

/// Refers to the maps.
class overlap_index {
 public:
  /// `cell` [m]: twice the tolerance that is asked for most.
  overlap_index(std::span<const prepared_stems> maps, double cell, const execution& exec)
      : maps_(maps), triangles_(maps.size()), further_(float(cell)) {
    parallel_for(
        exec, "triangles", maps.size(),
        [&](std::size_t m) { triangles_[m] = local_triangles(maps_[m], neighbors); }, 1);
    std::size_t count = 0;
    for (const auto& of_map : triangles_) count += of_map.size();
    constexpr std::size_t max_parts = 8;
    const std::size_t parts = std::min({maps.size(), std::size_t(thread_count(exec)), max_parts});
    grid_ = grid(
        count, float(cell), std::max<std::size_t>(1, parts),
        [&](std::size_t part, std::size_t all, const auto& visit) {
          for (std::size_t m = part * maps_.size() / all; m < (part + 1) * maps_.size() / all; ++m)
            for (std::size_t t = 0; t < triangles_[m].size(); ++t) visit(item_of<grid::item>(m, t));
        },
        [&](std::size_t all, const auto& work) { parallel_for(exec, "triangle cells", all, work, 1); });
  }

  /// Lets a further map, the last one of `maps`, ask for candidates; it is none before `keep_further`, and
  /// the next one takes its place.
  void set_further(std::span<const prepared_stems> maps) {
    triangles_.resize(maps.size());
    triangles_.back() = local_triangles(maps.back(), neighbors);
    maps_ = maps;
  }
  /// Adds the further map.
  void keep_further() {
    for (std::size_t t = 0; t < triangles_.back().size(); ++t)
      further_.add(item_of<further_triangles::item>(triangles_.size() - 1, t));
  }

  /// The transforms of a map onto later ones, or all others, that two votes or more ask for: those of most
  /// votes first, at most `maximum`. Edges of congruent triangles differ by less than `tolerance` [m].
  std::vector<overlap_candidate> candidates_of(std::size_t source, double tolerance, std::size_t maximum,
                                               bool all_others) const {
    std::vector<vote> votes = votes_of(source, tolerance, all_others);
    std::sort(votes.begin(), votes.end());
    std::vector<overlap_candidate> found;
    for (std::size_t begin = 0, end = 0; begin < votes.size(); begin = end) {
      while (end < votes.size() && votes[end].map == votes[begin].map) ++end;
      add_peaks(source, tolerance, std::span(votes).subspan(begin, end - begin), found);
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const auto& a, const auto& b) { return a.votes > b.votes; });
    if (found.size() > maximum) found.erase(found.begin() + std::ptrdiff_t(maximum), found.end());
    return found;
  }

 private:
  static constexpr std::size_t neighbors = 8;  // that a stem makes triangles with (ours)

  struct indexed_triangle {
    std::uint32_t map, number;
    float direction;  // [rad] of the longest edge
    float x, y;       // [m] of the centroid
  };
  using grid = wrapped_grid<float, 3, indexed_triangle>;
  using further_triangles = growing_grid<float, 3, indexed_triangle>;

  struct vote {
    std::uint32_t map;
    float yaw;                     // [rad] 0 to a full turn
    float x, y;                    // [m] where the middle of the source map is placed
    std::uint32_t source, target;  // triangles

    bool operator<(const vote& other) const {
      if (map != other.map) return map < other.map;
      if (yaw != other.yaw) return yaw < other.yaw;
      return source != other.source ? source < other.source : target < other.target;
    }
  };

  indexed_triangle described(std::size_t m, const triangle& t, std::size_t number) const {
    const auto& at = maps_[m].stems.at;
    const vec3 &a = at[t.vertices[0]], &b = at[t.vertices[1]], &c = at[t.vertices[2]];
    return {std::uint32_t(m), std::uint32_t(number), float(std::atan2(c.y - b.y, c.x - b.x)),
            float((a.x + b.x + c.x) / 3), float((a.y + b.y + c.y) / 3)};
  }
  template <class Item>
  Item item_of(std::size_t m, std::size_t t) const {
    return {edge_point(triangles_[m][t]), described(m, triangles_[m][t], t)};
  }

  /// The votes of the triangles that fewest others are like: the rest says little, and costs most.
  std::vector<vote> votes_of(std::size_t source, double tolerance, bool all_others) const {
    constexpr std::size_t max_like = 1024, votes_of_pair = 256, max_votes_of_map = 40'000,
                          at_once = 8;  // as many more are held, of maps of any size
    const std::size_t max_votes = std::min(max_votes_of_map, votes_of_pair * maps_.size());
    const vec2 middle = middle_of(source);
    std::vector<vote> votes;
    std::vector<keyed> triangles;  // by how many are like them; where their votes begin
    for (std::size_t t = 0; t < triangles_[source].size(); ++t) {
      if (t % 64 == 0) poll_cancelled();
      const std::size_t before = votes.size();
      bool is_common = false;
      for (const triangle& asked : admissible_orders(triangles_[source][t], tolerance)) {
        const indexed_triangle own = described(source, asked, t);
        const auto is_one_too_many = [&](const auto& item) {
          const indexed_triangle& other = item.label;
          if (other.map != source && (all_others || other.map > source))
            votes.push_back(vote_of(own, other, middle));
          return votes.size() - before > max_like;
        };
        is_common = is_common || grid_.any_near(edge_point(asked), float(tolerance), is_one_too_many) ||
                    further_.any_near(edge_point(asked), float(tolerance), is_one_too_many);
      }
      if (is_common)
        votes.resize(before);
      else if (votes.size() > before)
        triangles.push_back({votes.size() - before, before});
      if (votes.size() > at_once * max_votes) keep_rarest(votes, triangles, max_votes);
    }
    keep_rarest(votes, triangles, max_votes);
    return votes;
  }

  /// Leaves the votes of the triangles of fewest votes, in all at most `max_votes`. `triangles`: number of
  /// votes of each, and where they begin.
  static void keep_rarest(std::vector<vote>& votes, std::vector<keyed>& triangles, std::size_t max_votes) {
    if (votes.size() <= max_votes) return;
    sort_keyed(triangles);
    std::size_t kept = 0, total = 0;
    while (kept < triangles.size() && total + triangles[kept].key <= max_votes)
      total += triangles[kept++].key;
    triangles.resize(kept);
    std::sort(triangles.begin(), triangles.end(),
              [](const keyed& a, const keyed& b) { return a.value < b.value; });
    total = 0;
    for (keyed& t : triangles) {
      const auto begin = votes.begin() + std::ptrdiff_t(t.value);
      std::copy(begin, begin + std::ptrdiff_t(t.key), votes.begin() + std::ptrdiff_t(total));
      t.value = total;
      total += t.key;
    }
    votes.resize(total);
  }

  static vote vote_of(const indexed_triangle& own, const indexed_triangle& other, const vec2& middle) {
    constexpr float turn = 2 * std::numbers::pi_v<float>;
    float yaw = other.direction - own.direction;
    if (yaw < 0) yaw += turn;
    if (yaw < 0) yaw += turn;
    const float cosine = std::cos(yaw), sine = std::sin(yaw);
    const float arm_x = float(middle.x) - own.x, arm_y = float(middle.y) - own.y;
    return {other.map,
            yaw,
            other.x + cosine * arm_x - sine * arm_y,
            other.y + sine * arm_x + cosine * arm_y,
            own.number,
            other.number};
  }

  vec2 middle_of(std::size_t m) const {
    vec2 sum = vec2{};
    for (const vec3& p : maps_[m].stems.at) sum += p.xy();
    return maps_[m].stems.size() == 0 ? sum : sum / double(maps_[m].stems.size());
  }

  /// Adds the transforms that most of the votes for one map, sorted by yaw, agree on.
  void add_peaks(std::size_t source, double tolerance, std::span<const vote> votes,
                 std::vector<overlap_candidate>& found) const {
    constexpr std::size_t max_peaks = 3, min_votes = 2;
    std::vector<bool> taken(votes.size(), false);
    for (std::size_t peak = 0; peak < max_peaks; ++peak) {
      std::size_t most = min_votes - 1, best = 0;
      for (std::size_t i = 0; i < votes.size(); ++i)
        if (!taken[i])
          if (const std::size_t count = visit_agreeing(votes, i, taken, [](std::size_t) {}); count > most)
            most = count, best = i;
      if (most < min_votes) break;
      overlap_candidate candidate{std::uint32_t(source), votes[best].map, 0, {}};
      std::vector<std::size_t> agreeing;
      visit_agreeing(votes, best, taken, [&](std::size_t i) { agreeing.push_back(i); });
      for (const std::size_t i : agreeing) add_vote(candidate, tolerance, votes[i]), taken[i] = true;
      found.push_back(std::move(candidate));
    }
  }

  void add_vote(overlap_candidate& candidate, double tolerance, const vote& v) const {
    constexpr std::size_t max_pairs = 48;
    constexpr double rounding = 1e-3;  // of the index, which has floats
    ++candidate.votes;
    if (candidate.pairs.size() >= max_pairs) return;
    // The order of the vertices that agrees with the yaw; the triangle may have been asked in another.
    for (const triangle& asked : admissible_orders(triangles_[candidate.source][v.source], tolerance)) {
      const triangle& target = triangles_[candidate.target][v.target];
      bool alike = true;
      for (std::size_t e = 0; e < 3; ++e)
        alike = alike && std::abs(asked.edges[e] - target.edges[e]) <= tolerance * (1 + rounding);
      if (!alike) continue;
      for (std::size_t i = 0; i < 3; ++i) candidate.pairs.push_back({asked.vertices[i], target.vertices[i]});
      return;
    }
  }

  /// Visits the votes that agree with vote `i`, whose yaws follow on its own, and counts them; no more than
  /// decide.
  template <class Visit>
  static std::size_t visit_agreeing(std::span<const vote> votes, std::size_t i,
                                    const std::vector<bool>& taken, const Visit& visit) {
    constexpr float yaw_width = 0.12f, half_width = 1.25f;  // [rad] [m] four deviations of a vote (ours)
    constexpr float turn = 2 * std::numbers::pi_v<float>;
    constexpr std::size_t enough = 24;
    std::size_t count = 0;
    for (std::size_t step = 0; step < votes.size() && count < enough; ++step) {
      const std::size_t j = i + step < votes.size() ? i + step : i + step - votes.size();
      float ahead = votes[j].yaw - votes[i].yaw;
      if (ahead < 0) ahead += turn;
      if (ahead > yaw_width) break;
      if (taken[j] || std::abs(votes[j].x - votes[i].x) > half_width ||
          std::abs(votes[j].y - votes[i].y) > half_width)
        continue;
      visit(j);
      ++count;
    }
    return count;
  }

  std::span<const prepared_stems> maps_;
  std::vector<std::vector<triangle>> triangles_;  // of each map
  grid grid_;
  further_triangles further_;
};

}  // namespace globalmatch::detail

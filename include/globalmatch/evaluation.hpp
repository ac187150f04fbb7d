// Evaluation ([GM] 5.1.2): errors of a registration against the truth; precision, recall and F1 of a stem
// map.
#pragma once

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <vector>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch {

/// Errors of a transform target_from_source.
struct registration_error {
  double rotation = 0;     ///< [rad] e_R
  double translation = 0;  ///< [m] e_t
  double pointwise = 0;    ///< [m] e_p, mean over the source points, [GM] Eq. (10)
  double horizontal = 0;   ///< [m] mean length of its part across `up`
  double vertical = 0;     ///< [m] mean length of its part along `up`

  /// [GM] 5.1.2: a pointwise error below half a metre is a success.
  bool success(double threshold = 0.5) const { return pointwise < threshold; }
};

/// Compares an estimated transform with the true one over the points of the source scan; points that are not
/// finite do not count. `up` is that of the target frame. The pointwise errors are 0 when there are no
/// points. Throws `std::invalid_argument` when `up` is zero or not finite.
template <point_range R>
registration_error evaluate_registration(const Eigen::Isometry3d& estimate, const Eigen::Isometry3d& truth,
                                         const R& source,
                                         const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ()) {
  const detail::rigid estimated = detail::from_eigen(estimate), actual = detail::from_eigen(truth);
  const detail::vec3 given_up = detail::from_eigen(up), direction = given_up.stable_normalized();
  if (!is_finite(given_up) || given_up.max_abs() == 0)
    throw std::invalid_argument("up must be a finite vector other than zero");
  registration_error error;
  // The arccosine of [GM] Eq. (8) loses half the digits of small angles; the angle of the difference none.
  error.rotation = detail::rotation_angle(actual.rotation * estimated.rotation.transpose());
  error.translation = (estimated.translation - actual.translation).norm();
  std::size_t count = 0;
  for (const auto& p : source) {
    const detail::vec3 v = xyz(p);
    if (!is_finite(v)) continue;
    const detail::vec3 d = estimated * v - actual * v;
    const double along = direction.dot(d);
    error.pointwise += d.norm();
    error.vertical += std::abs(along);
    error.horizontal += (d - along * direction).norm();
    ++count;
  }
  if (count > 0)
    for (double* mean : {&error.pointwise, &error.vertical, &error.horizontal}) *mean /= double(count);
  return error;
}

/// How well a stem map agrees with the true one.
struct map_score {
  std::size_t found = 0;           ///< stems in the map
  std::size_t true_finds = 0;      ///< of these a true stem stands there
  std::size_t required = 0;        ///< true stems that should have been found
  std::size_t required_found = 0;  ///< of these in the map
  double horizontal_error = 0;     ///< [m] mean over the true finds
  double height_error = 0;         ///< [m] mean absolute, over the true finds

  /// Share of the finds that are true.
  double precision() const { return found > 0 ? double(true_finds) / double(found) : 1; }
  /// Share of the required stems that were found.
  double recall() const { return required > 0 ? double(required_found) / double(required) : 1; }
  /// Harmonic mean of precision and recall.
  double f1() const {
    const double sum = precision() + recall();
    return sum > 0 ? 2 * precision() * recall() / sum : 0;
  }
};

/// A find, and the true stem that stands there.
struct true_find {
  std::size_t find, stem;  ///< indices, of the map and of the true stems
};

namespace detail {

template <position_range R>
std::vector<vec3> coordinates_of(const R& positions) {
  std::vector<vec3> result;
  for (const auto& p : positions) result.push_back(xyz(p));
  return result;
}

inline std::vector<true_find> pair_finds(const std::vector<vec3>& finds, const std::vector<vec3>& stems,
                                         double distance) {
  if (!(distance > 0)) throw std::invalid_argument("pair_finds: distance must be positive");
  struct candidate {
    double distance;
    true_find pair;
  };
  std::vector<candidate> candidates;
  for (std::size_t i = 0; i < finds.size(); ++i)
    for (std::size_t j = 0; j < stems.size(); ++j) {
      const double d = (finds[i] - stems[j]).xy().norm();
      if (d < distance) candidates.push_back({d, {i, j}});
    }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const candidate& a, const candidate& b) { return a.distance < b.distance; });
  std::vector<bool> find_taken(finds.size()), stem_taken(stems.size());
  std::vector<true_find> pairs;
  for (const auto& [apart, pair] : candidates) {
    if (find_taken[pair.find] || stem_taken[pair.stem]) continue;
    find_taken[pair.find] = stem_taken[pair.stem] = true;
    pairs.push_back(pair);
  }
  return pairs;
}

}  // namespace detail

/// Pairs found and true stems one to one, horizontally nearest first, within `distance` [m] horizontally;
/// both in one frame whose z is up. Throws `std::invalid_argument` when `distance` is not positive.
template <position_range Found, position_range Truth>
std::vector<true_find> pair_finds(const Found& found, const Truth& truth, double distance = 0.25) {
  return detail::pair_finds(detail::coordinates_of(found), detail::coordinates_of(truth), distance);
}

/// Scores finds, paired as `pair_finds` does. `is_required(i)` says whether true stem i should have been
/// found: recall counts only those.
template <position_range Found, position_range Truth, class Required>
map_score score_map(const Found& found, const Truth& truth, double distance, const Required& is_required) {
  const std::vector<detail::vec3> finds = detail::coordinates_of(found),
                                  stems = detail::coordinates_of(truth);
  map_score score{.found = finds.size()};
  std::vector<bool> stem_found(stems.size());
  for (const auto& [find, stem] : detail::pair_finds(finds, stems, distance)) {
    const detail::vec3 error = finds[find] - stems[stem];
    ++score.true_finds;
    score.horizontal_error += error.xy().norm();
    score.height_error += std::abs(error.z);
    stem_found[stem] = true;
  }
  if (score.true_finds > 0)
    for (double* mean : {&score.horizontal_error, &score.height_error}) *mean /= double(score.true_finds);
  for (std::size_t j = 0; j < stems.size(); ++j) {
    if (!is_required(j)) continue;
    ++score.required;
    score.required_found += stem_found[j] ? 1 : 0;
  }
  return score;
}

/// The same when every true stem should have been found.
template <position_range Found, position_range Truth>
map_score score_map(const Found& found, const Truth& truth, double distance = 0.25) {
  return score_map(found, truth, distance, [](std::size_t) { return true; });
}

}  // namespace globalmatch

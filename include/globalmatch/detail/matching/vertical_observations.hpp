// What paired stems observe of the small transform between a hypothesis and the truth: in plan, in height,
// and by their axes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/detail/matching/robust_fit.hpp"
#include "globalmatch/detail/matching/t_estimates.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// Standard deviations as multiples of one that is common to all: a known variance adds to one as large as
/// the median, so that no stem is much more certain than the rest. 1 where none is known.
inline std::vector<double> relative_sigmas(const std::vector<double>& variances) {
  std::vector<double> sorted = variances;
  const double usual = median(sorted);
  std::vector<double> result;
  for (const double variance : variances)
    result.push_back(usual > 0 ? std::sqrt((variance + usual) / (2 * usual)) : 1);
  return result;
}

/// What is observed of the small transform that leads from a hypothesis to the truth: a shift of x, y and z
/// [m], and turns [rad] about the axes through `center`.
class vertical_observations {
 public:
  /// Of some thousands of pairs where there are more.
  vertical_observations(const matching_context& context, std::span<const correspondence> pairs)
      : context_(context) {
    constexpr std::size_t max_pairs = 4096;
    const std::size_t step = std::max<std::size_t>(1, (pairs.size() + max_pairs - 1) / max_pairs);
    std::vector<double> horizontal, vertical;
    for (std::size_t i = 0; i < pairs.size(); i += step) {
      pairs_.push_back(pairs[i]);
      horizontal.push_back(known_variance(context, pairs[i]));
      vertical.push_back(variance_of_heights(pairs[i]));
    }
    position_sigmas_ = relative_sigmas(horizontal);
    height_sigmas_ = relative_sigmas(vertical);
    known_height_variance_ = median(vertical);  // reorders them
  }

  std::size_t size() const { return pairs_.size(); }
  /// [m^2] of the heights of a pair, as the stems know it; 0 where they do not
  double known_height_variance() const { return known_height_variance_; }

  /// [m] centroid of the pairs
  vec3 center(const rigid& transform) const {
    vec3 sum;
    for (const correspondence& c : pairs_)
      sum += transform * context_.source.at[c.source] / double(pairs_.size());
    return sum;
  }

  /// [m^2] mean square at the pairs of a plane through `center` that turns about x and y by small angles
  /// [rad]
  double plane_variance(const rigid& transform, const vec3& center, double about_x, double about_y) const {
    double sum = 0;
    for (const correspondence& c : pairs_) {
      const vec3 arm = transform * context_.source.at[c.source] - center;
      const double above = about_x * arm.y - about_y * arm.x;
      sum += above * above / double(pairs_.size());
    }
    return sum;
  }

  /// Of positions in plan; `tilts`: turns about x and y are parameters, or they are 0.
  observation_kind positions(const rigid& transform, const vec3& center, bool tilts) const {
    observation_kind kind{.dimensions = 2};
    kind.of.reserve(pairs_.size());
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const vec3 transformed = transform * context_.source.at[pairs_[i].source];
      const vec3 arm = transformed - center, off = context_.target.at[pairs_[i].target] - transformed;
      const double lever = tilts ? arm.z : 0;
      kind.of.push_back({{{{{1, 0, 0, 0, lever, -arm.y}, off.x}, {{0, 1, 0, -lever, 0, arm.x}, off.y}}},
                         position_sigmas_[i]});
    }
    return kind;
  }

  /// Of heights; `tilts`: they differ by a plane, or by a constant.
  observation_kind heights(const rigid& transform, const vec3& center, bool tilts) const {
    observation_kind kind{.dimensions = 1};
    kind.of.reserve(pairs_.size());
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const vec3 transformed = transform * context_.source.at[pairs_[i].source];
      const vec3 arm = tilts ? transformed - center : vec3{};
      const double off = context_.target.at[pairs_[i].target].z - transformed.z;
      kind.of.push_back({{{{{0, 0, 1, arm.y, -arm.x, 0}, off}}}, height_sigmas_[i]});
    }
    return kind;
  }

  /// Of the stems' axes, where both maps know them.
  observation_kind axes(const rigid& transform, bool tilts) const {
    observation_kind kind{.dimensions = 2};
    if (context_.source.axis.empty() || context_.target.axis.empty()) return kind;
    const double known = tilts ? 1 : 0;
    for (const correspondence& c : pairs_) {
      const vec3 from = transform.rotation * context_.source.axis[c.source],
                 to = context_.target.axis[c.target];
      if (!(from.squared_norm() > 0 && to.squared_norm() > 0)) continue;
      const vec3 turn = from.cross(to);
      kind.of.push_back({{{{{0, 0, 0, known, 0, 0}, turn.x}, {{0, 0, 0, 0, known, 0}, turn.y}}}});
    }
    return kind;
  }

 private:
  double variance_of_heights(const correspondence& c) const {
    const auto of = [](const position_set& stems, stem_index i) {
      return stems.height_sigma.empty() ? 0 : stems.height_sigma[i] * stems.height_sigma[i];
    };
    return of(context_.source, c.source) + of(context_.target, c.target);
  }

  const matching_context& context_;
  std::vector<correspondence> pairs_;
  double known_height_variance_ = 0;
  std::vector<double> position_sigmas_, height_sigmas_;
};

}  // namespace globalmatch::detail

// Stem matching ([GM] 3.2): two sets of stem positions -> the transform between their scans. Needs no ground,
// no scan.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <memory>
#include <stdexcept>
#include <utility>

#include "globalmatch/detail/core/compiled.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/matching_options.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch {

namespace detail {
struct prepared_stems;
}

/// A stem map that many others are matched against, made by `prepare_map`. Immutable, owns its data, may be
/// shared by threads, and is cheap to copy.
class prepared_map {
 public:
  /// Not prepared: matching against it throws.
  prepared_map() = default;
  /// For `prepare_map`.
  prepared_map(std::shared_ptr<const detail::prepared_stems> stems, std::size_t size)
      : stems_(std::move(stems)), size_(size) {}

  /// Stems in it.
  std::size_t size() const { return size_; }
  /// For `match_stems`; null when not prepared.
  const detail::prepared_stems* get() const { return stems_.get(); }

 private:
  std::shared_ptr<const detail::prepared_stems> stems_;
  std::size_t size_ = 0;
};

namespace detail {

struct scan_views;

/// `match_stems` for positions whose frames may be levelled by different ups. `views`: what the scanners of
/// both saw, if that is known, for maps that keep their scale. Throws `operation_cancelled`.
GLOBALMATCH_INLINE matching match_positions(position_set source, position_set target,
                                            const matching_options& options, const execution& exec,
                                            const scan_views* views = nullptr, build_mode = {});

/// The same against a prepared map.
GLOBALMATCH_INLINE matching match_positions(const position_set& source, const prepared_stems& target,
                                            const matching_options& options, const execution& exec,
                                            build_mode = {});

/// `score_transform` for positions in the internal representation.
GLOBALMATCH_INLINE hypothesis score_given(const position_set& source, const position_set& target,
                                          const Eigen::Isometry3d& target_from_source,
                                          const matching_options& options, const execution& exec,
                                          build_mode = {});

/// `prepare_map` for positions in the internal representation.
GLOBALMATCH_INLINE std::shared_ptr<const prepared_stems> prepare_positions(position_set stems,
                                                                           bool horizontal_distances,
                                                                           const execution& exec,
                                                                           build_mode = {});

inline matching cancelled_matching(const operation_cancelled& e) {
  matching result;
  result.outcome = outcome::cancelled;
  result.reason = e.what();
  return result;
}

}  // namespace detail

/// Prepares a map that many others are matched against, with heights or without. Positions as in
/// `match_stems`; `options.dof` is that of the matches to come. Throws as `match_stems` does, and
/// `operation_cancelled` when the progress callback says so. Cost: linear in the stems.
template <position_range R>
prepared_map prepare_map(const R& stems, const matching_options& options = {},
                         const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(), const execution& exec = {}) {
  require_valid(options);
  const detail::parallel_scope scope(exec, "matching");
  position_set set = import_positions(stems, up, "stems", exec);
  const bool horizontal_distances = options.dof != degrees_of_freedom::six;
  if (!horizontal_distances && !set.has_heights)
    throw std::invalid_argument("dof: six degrees of freedom need heights in the map");
  const std::size_t size = set.size();
  return {detail::prepare_positions(std::move(set), horizontal_distances, exec), size};
}

/// Matches positions against a prepared map, the larger one of both: triangles of the source are looked up in
/// it. Throws `std::invalid_argument` also when it was prepared for other degrees of freedom, or not at all.
template <position_range Source>
matching match_stems(const Source& source, const prepared_map& target, const matching_options& options = {},
                     const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(), const execution& exec = {}) {
  require_valid(options);
  if (!target.get()) throw std::invalid_argument("target: the map was not prepared; prepare_map does that");
  try {
    const detail::parallel_scope scope(exec, "matching");
    return detail::match_positions(import_positions(source, up, "source", exec), *target.get(), options,
                                   exec);
  } catch (const operation_cancelled& e) {
    return detail::cancelled_matching(e);
  }
}

/// Finds the transform of the source stems onto the target stems, from their relative positions alone.
/// Positions are of the caller's types, with or without heights. `up` points away from the ground in both
/// frames. No trustworthy transform is an answer: `outcome` and `reason` say so, and `target_from_source` is
/// empty. Throws `std::invalid_argument` naming a bad option or a position that is not finite. Cost:
/// linear in the stems, n log n to sort them; with `proposal::algorithm_1` about quadratic.
template <position_range Source, position_range Target>
matching match_stems(const Source& source, const Target& target, const matching_options& options = {},
                     const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(), const execution& exec = {}) {
  try {
    const detail::parallel_scope scope(exec, "matching");
    return detail::match_positions(import_positions(source, up, "source", exec),
                                   import_positions(target, up, "target", exec), options, exec);
  } catch (const operation_cancelled& e) {
    return detail::cancelled_matching(e);
  }
}

/// Scores a transform that was not found by matching: a guess, a prior, that of another program. Nothing is
/// searched or fitted. Of the hypothesis that is returned `target_from_source` is the given one, the stems
/// are paired at the inlier threshold of the smallest NFA, or at that of the options, and the NFA is that of
/// this one transform: as many stems are as near at random, at some threshold. Throws `std::invalid_argument`
/// as `match_stems` does, and for what is no rotation and shift, and `operation_cancelled` when the progress
/// callback says so while positions are read. Cost: linear in the stems.
template <position_range Source, position_range Target>
hypothesis score_transform(const Source& source, const Target& target,
                           const Eigen::Isometry3d& target_from_source, const matching_options& options = {},
                           const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(), const execution& exec = {}) {
  require_valid(options);
  return detail::score_given(import_positions(source, up, "source", exec),
                             import_positions(target, up, "target", exec), target_from_source, options, exec);
}

}  // namespace globalmatch

#if !defined(GLOBALMATCH_COMPILED)
#include "globalmatch/detail/verbs/match_positions.hpp"
#endif

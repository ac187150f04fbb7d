// Two mapped scans registered, and the transforms compared with the truth.
#pragma once

#include <globalmatch/evaluation.hpp>
#include <globalmatch/registration.hpp>

#include "evaluated_scans.hpp"
#include "normalised_errors.hpp"
#include "support/programs/reports.hpp"

#include <Eigen/Geometry>

#include <cstddef>
#include <optional>
#include <ostream>

namespace globalmatch::benchmarks {

/// Two scans registered.
struct evaluated_pair {
  globalmatch::outcome outcome = outcome::not_registered;
  std::optional<Eigen::Isometry3d> target_from_source = {};  ///< where it is registered
  std::size_t matches = 0, source_stems = 0, target_stems = 0;
  std::optional<registration_error> coarse, fine;  ///< of the best hypothesis; after ICP, where it ran
  double matching_seconds = 0, icp_seconds = 0;

  /// Of the transform that was returned.
  const std::optional<registration_error>& returned() const { return fine ? fine : coarse; }
  bool right() const { return outcome == outcome::registered && returned()->success(); }
  bool wrong() const { return outcome == outcome::registered && !returned()->success(); }
};

/// `truth` is target_from_source, `up` that of the target. Errors of the coarse transform over their
/// uncertainty go to `normalised` where it is right.
inline evaluated_pair register_pair(const evaluated_scan& source, const evaluated_scan& target,
                                    const Eigen::Isometry3d& truth, const Eigen::Vector3d& up,
                                    const registration_options& options, int threads,
                                    normalised_errors& normalised) {
  const auto error = [&](const Eigen::Isometry3d& transform) {
    return evaluate_registration(transform, truth, source.sample, up);
  };
  support::stage_clock clock;
  const registration result = register_maps(source.map, target.map, options, clock.listen(threads));
  evaluated_pair pair;
  const auto stages = clock.stages();
  if (stages.contains("icp")) pair.icp_seconds = stages["icp"].get<double>();
  pair.matching_seconds = clock.seconds() - pair.icp_seconds;
  pair.outcome = result.outcome;
  pair.target_from_source = result.target_from_source;
  pair.matches = result.matching.funnel.correspondences;
  pair.source_stems = source.map.stems.size();
  pair.target_stems = target.map.stems.size();
  if (!result.matching.hypotheses.empty())
    pair.coarse = error(result.matching.hypotheses.front().target_from_source);
  if (result.icp && result.icp->converged) pair.fine = error(*result.target_from_source);
  if (const auto& matched = result.matching; matched.uncertainty && pair.coarse->success())
    normalised.add(*matched.target_from_source, truth, *matched.uncertainty, matched.vertical->is_known());
  return pair;
}

constexpr const char* evaluated_pair_columns =
    "outcome,source_stems,target_stems,matches,matching_seconds,icp_seconds,coarse_e_p,coarse_e_R,coarse_e_t,"
    "fine_e_p,fine_horizontal,fine_vertical,fine_e_R,fine_e_t";

/// Fields of a line of CSV; what there is not stays empty.
inline void write_fields(std::ostream& out, const evaluated_pair& p) {
  out << to_string(p.outcome) << ',' << p.source_stems << ',' << p.target_stems << ',' << p.matches << ','
      << p.matching_seconds << ',' << p.icp_seconds;
  if (const auto& e = p.coarse)
    out << ',' << e->pointwise << ',' << e->rotation << ',' << e->translation;
  else
    out << ",,,";
  if (const auto& e = p.fine)
    out << ',' << e->pointwise << ',' << e->horizontal << ',' << e->vertical << ',' << e->rotation << ','
        << e->translation;
  else
    out << ",,,,,";
}

}  // namespace globalmatch::benchmarks

// Plots in folders, for their evaluation: one scan open at a time.
#pragma once

#include "evaluate_plot.hpp"
#include "find_plots.hpp"
#include "stem_truth.hpp"
#include "support/scan_files.hpp"
#include "support/scan_mapping.hpp"

#include <cstddef>
#include <utility>

namespace globalmatch::benchmarks {

inline mapped_scan map_stored_scan(const stored_plot& plot, std::size_t i,
                                   const support::scan_options& reading, const evaluation_options& options) {
  const support::scan_file scan = support::open_scan(plot.scans[i], reading);
  if (scan.empty())
    throw support::file_error(plot.scans[i], "holds no points", "Move it away, or export it again");
  const Eigen::Isometry3d& plot_from_scan = plot.truth.plot_from_scan(i);
  mapped_scan mapped = map_for_evaluation(scan, plot_from_scan, options);
  if (!plot.stems[i]) return mapped;
  stem_truth truth = read_stem_truth(*plot.stems[i], plot.names[i], plot_from_scan);
  auto returns = truth.returns ? *std::move(truth.returns) : count_returns(scan, plot_from_scan, truth);
  mapped.stems_are_of_plot = truth.is_of_plot;
  mapped.stems = {std::move(truth.positions), std::move(returns)};
  return mapped;
}

/// `plot` must outlive what is returned.
inline plot_to_evaluate to_evaluate(const stored_plot& plot, const support::scan_options& reading,
                                    const evaluation_options& options) {
  return {plot.name, plot.names, plot.truth, plot.middle,
          [&plot, reading, &options](std::size_t i) { return map_stored_scan(plot, i, reading, options); }};
}

}  // namespace globalmatch::benchmarks

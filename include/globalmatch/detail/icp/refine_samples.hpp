// `refine_by_icp` for samples in the internal representation.
#pragma once

#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/compiled.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/core/rigid_fit.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/icp/icp_steps.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/icp_options.hpp"

namespace globalmatch::detail {

GLOBALMATCH_INLINE icp_result refine_samples(std::vector<icp_samples> layers, const rigid& coarse,
                                             degrees_of_freedom dof, const icp_options& options,
                                             const execution& exec, icp_uncertainty* uncertainty,
                                             build_mode) {
  require_valid(options);
  if (!is_finite(coarse)) throw std::invalid_argument("coarse must be finite");
  std::erase_if(layers,
                [](const icp_samples& layer) { return layer.source.empty() || layer.target.empty(); });
  if (options.metric != icp_metric::none && !layers.empty()) {
    const parallel_scope scope(exec, "icp");
    return refine_layers(std::move(layers), coarse, dof, options, exec, uncertainty);
  }
  icp_result result;
  result.target_from_source = to_eigen(coarse);
  return result;
}

}  // namespace globalmatch::detail

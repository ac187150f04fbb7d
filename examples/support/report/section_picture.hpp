// A vertical section through two registered scans: where it is laid out, and its picture.
#pragma once

#include <Eigen/Geometry>

#include <optional>
#include <ostream>
#include <span>
#include <utility>
#include <vector>

#include "support/report/stem_plans.hpp"
#include "support/scan_sample.hpp"

namespace globalmatch::support {

/// The section through most matched stems, in the upright frame of the target; empty where fewer than two are
/// matched.
std::optional<vertical_section> section_through(const upright_map& target, const shown_transform& shown);

/// Draws points of both scans in the frame of the section, at one scale along and up.
void draw_section(std::ostream& out, const vertical_section& section, std::span<const sampled_point> source,
                  std::span<const sampled_point> target);

}  // namespace globalmatch::support

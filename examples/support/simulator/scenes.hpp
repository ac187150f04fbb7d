// The frozen list of simulated scenes that everything is measured on.
#pragma once

#include "support/simulator/simulation.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace globalmatch::support {

struct named_scene {
  std::string name;
  std::string about;  ///< what it stands for
  simulation_options options;
};

/// Seeds to tune on, and seeds that results are reported on and nothing is tuned on.
inline constexpr std::uint64_t tuning_seeds[] = {1, 2};
inline constexpr std::uint64_t reporting_seeds[] = {101, 102};

/// All scenes, in the order of the documentation. None may change once results are reported on it.
const std::vector<named_scene>& frozen_scenes();

/// Throws `std::invalid_argument`, listing the names, when there is no such scene.
const named_scene& find_scene(std::string_view name);

/// The list as a Markdown table: `docs/scenes.md` contains it word for word.
std::string scene_table();

}  // namespace globalmatch::support

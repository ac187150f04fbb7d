// The simulator's options on a command line.
#pragma once

#include <CLI/CLI.hpp>

#include "support/simulator/simulation.hpp"

namespace globalmatch::support {

/// They are read in the order in which they are added: a scene first, and what else is given overrides it.
void add_simulation_options(CLI::App& app, simulation_options& options);

}  // namespace globalmatch::support

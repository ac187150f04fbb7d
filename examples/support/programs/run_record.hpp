// What every run of a program records of itself in JSON, beside its results.
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <vector>

#include "support/programs/reports.hpp"

namespace globalmatch::support {

/// `seconds` and `stages` so far; `globalmatch{version,commit,compiler,processor}`, null where it is not
/// known; `command` as it was given, and `options` with the values that are used, also of those not given.
nlohmann::ordered_json describe_run(const CLI::App& app, const std::vector<std::string>& command,
                                    stage_clock& clock);

/// `[{path,bytes,hash}]` of files that were read, or folders of tiles. The scan `name#K` has the hash of its
/// file. What cannot be read again, as standard input, has null for both. Reads all files.
nlohmann::ordered_json describe_files(const std::vector<std::filesystem::path>& files);

}  // namespace globalmatch::support

// What register_survey is asked for on its command line.
#pragma once

#include <CLI/CLI.hpp>

#include <filesystem>
#include <string>
#include <vector>

#include "support/command_line.hpp"

namespace globalmatch::support {

struct survey_command {
  std::vector<std::filesystem::path> scans, stem_maps;  ///< one of them
  std::filesystem::path out_dir, picture;
  std::string fix;         ///< NAME=T.txt
  std::string only, part;  ///< a stage, and "I/N"
  shared_options options;

  /// Adds all options. The command must outlive the app.
  void add_to(CLI::App& app);

  /// The scans, or the stem maps, one by one. Throws `file_error`, and `std::invalid_argument` for none.
  std::vector<std::filesystem::path> inputs() const;
};

}  // namespace globalmatch::support

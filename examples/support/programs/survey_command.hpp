// What register_survey is asked for on its command line.
#pragma once

#include <CLI/CLI.hpp>

#include <filesystem>
#include <string>
#include <vector>

#include "support/programs/command_line.hpp"

namespace globalmatch::support {

struct survey_command {
  std::vector<std::filesystem::path> scans, stem_maps;  ///< one of them
  std::filesystem::path out_dir, picture;
  std::vector<std::string> fix;     ///< NAME=T.txt each
  std::vector<std::string> levels;  ///< NAME,SIGMA_DEG each
  std::filesystem::path priors;     ///< table of what was measured of scans
  std::filesystem::path control;    ///< table of trees in the survey's frame
  std::filesystem::path targets;    ///< table of those that scans show
  std::filesystem::path write_folder, posed_folder, merged;
  std::string write_format;  ///< extension without point; empty: that of each scan
  double voxel = 0.01;       ///< [m] of the merged scans
  std::string only, part;    ///< a stage, and "I/N"
  shared_options options;

  /// Adds all options. The command must outlive the app.
  void add_to(CLI::App& app);

  /// Throws `std::invalid_argument` naming an option that does not fit the others.
  void require_consistent() const;

  /// Makes the folder of results, and removes from it what runs that were stopped have left half written.
  /// Throws `file_error`.
  void prepare_folder() const;

  /// The scans, or the stem maps, one by one. Throws `file_error`.
  std::vector<std::filesystem::path> inputs() const;
};

}  // namespace globalmatch::support

// What the example programs have in common on their command lines, and how they end.
#pragma once

#include <globalmatch/mapping_options.hpp>

#include <CLI/CLI.hpp>
#include <Eigen/Core>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "support/point_source.hpp"

namespace globalmatch {
struct matching_options;
struct icp_options;
}  // namespace globalmatch

namespace globalmatch::support {

/// Exit statuses of all programs.
enum exit_status { done = 0, no_registration = 1, unusable_input = 2 };

/// Options that several programs share; each adds the groups that apply to it.
struct shared_options {
  std::vector<double> up = {0, 0, 1};
  std::vector<double> scanner;
  std::uint64_t seed = 1;
  double min_quality = mapping_options{}.min_quality;
  bool no_verticality = false;
  bool normalized = false;
  bool keep_noise = false;
  bool tiles = false;
  double memory = 4;  ///< [GB]
  std::string vertical = "auto";
  std::string dof = "auto";
  std::optional<double> tolerance;
  bool require_height = false;
  bool horizontal = false;
  bool scale = false;
  double comparisons = 1;
  std::filesystem::path prior;
  std::vector<double> prior_sigma = {5, 10};  ///< [m], [degrees]
  std::string icp = "plane";
  int threads = 0;
  std::filesystem::path json;
  std::vector<std::filesystem::path> out_as;

  void add_mapping_to(CLI::App& app);               ///< --up --vertical --scanner --seed --no-verticality ...
  void add_matching_to(CLI::App& app);              ///< --dof --tolerance --horizontal --comparisons ...
  void add_prior_to(CLI::App& app);                 ///< --prior --prior-sigma
  void add_icp_to(CLI::App& app);                   ///< --icp
  void add_forms_to(CLI::App& app, bool of_scans);  ///< --out-as
  void add_threads_to(CLI::App& app);               ///< --threads
  void add_execution_to(CLI::App& app);             ///< --threads --json

  Eigen::Vector3d up_direction() const { return {up[0], up[1], up[2]}; }
  scan_options for_reading() const;
  mapping_options for_mapping() const;
  matching_options for_matching() const;
  icp_options for_icp() const;
};

/// Parses the command line and runs `body`, which returns an exit status. Wrong usage, unreadable input and
/// unwritable output (`CLI::ParseError`, `file_error`, `std::invalid_argument`) are reported on standard
/// error and end in status 2.
int run_program(CLI::App& app, int argc, char** argv, const std::function<int()>& body);

}  // namespace globalmatch::support

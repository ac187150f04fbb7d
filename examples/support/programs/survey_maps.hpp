// The stem maps of a survey: mapped once, and kept in files.
#pragma once

#include <globalmatch/execution.hpp>
#include <globalmatch/stem_map.hpp>
#include <globalmatch/stem_map_io.hpp>

#include <filesystem>
#include <optional>
#include <string>

#include "support/programs/command_line.hpp"
#include "support/programs/survey_inputs.hpp"

namespace globalmatch::support {

/// A scan of a survey, as far as it was mapped.
struct survey_map {
  stem_map map = {};       ///< without samples, and without heights of the ground
  std::string error = {};  ///< why the scan cannot be read; empty where it can
  bool was_kept = false;   ///< the map was there, and is still that of the scan
};

/// All that the stems of a scan depend on, besides its points.
std::string describe_mapping(const shared_options& options);

/// A map of nothing but the positions in a table of stems, and their radii where these are known.
survey_map read_positions(const survey_input& input);

/// Maps scans into a folder of `NAME.gmap` files. A file that is there is used where scan, options, version
/// and processor are those that it was made with.
class survey_mapper {
 public:
  /// Refers to the options. Makes the folder. Throws `file_error`. `mixes_builds`: a map that another build
  /// made is made again; otherwise it is refused, as other machines work with it.
  survey_mapper(const std::filesystem::path& folder, const shared_options& options, bool mixes_builds);

  /// Maps a scan, or reads its map, and writes a new one whole or not at all. Throws `file_error` where that
  /// cannot be written or a map is refused, and `operation_cancelled`.
  survey_map map(const survey_input& input, const execution& exec) const;

  /// The map of a scan that `map` was called for, with its samples. Throws `file_error` where the file is
  /// gone or damaged.
  stem_map with_samples(const std::string& name) const;

  /// What that map was made of. Throws `file_error` alike.
  stem_map_file::scan_record record_of(const std::string& name) const;

 private:
  std::filesystem::path file_of(const std::string& name) const { return folder_ / (name + ".gmap"); }
  std::optional<stem_map> kept(const survey_input& input) const;
  stem_map_file read(const std::string& name, stem_map_file::parts parts) const;
  stem_map_file::scan_record record_of(const survey_input& input) const;

  std::filesystem::path folder_;
  const shared_options& options_;
  bool mixes_builds_;
};

}  // namespace globalmatch::support

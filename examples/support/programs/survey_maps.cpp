#include "support/programs/survey_maps.hpp"

#include <globalmatch/stem_mapping.hpp>

#include <exception>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>
#include <vector>

#include "support/atomic_file.hpp"
#include "support/build_record.hpp"
#include "support/file_error.hpp"
#include "support/scan_files.hpp"
#include "support/scan_mapping.hpp"
#include "support/stem_files.hpp"

namespace globalmatch::support {

namespace fs = std::filesystem;

std::string describe_mapping(const shared_options& options) {
  return nlohmann::ordered_json{{"up", options.up},
                                {"vertical", options.vertical},
                                {"seed", options.seed},
                                {"min_quality", options.min_quality},
                                {"no_verticality", options.no_verticality},
                                {"normalized", options.normalized},
                                {"keep_noise", options.keep_noise},
                                {"tiles", options.tiles}}
      .dump();
}

survey_map read_positions(const survey_input& input) {
  survey_map result;
  result.error = input.error;
  if (!result.error.empty() || input.same_as) return result;
  try {
    for (const stem_record& s : read_stems(input.path).stems) {
      stem known;
      known.position = {s.x, s.y, s.z};
      known.axis = Eigen::Vector3d::Zero();  // not known: it must not say that the map is upright
      known.radius = s.radius > 0 ? s.radius : 0;
      result.map.stems.push_back(known);
    }
  } catch (const file_error& e) {
    result.error = e.what();
  }
  return result;
}

namespace {

/// Gives the memory back, which `v = {}` does not.
template <class T>
void release(std::vector<T>& v) {
  std::vector<T>().swap(v);
}

/// Leaves out what is read again where it is needed: samples, the heights of the ground, and which points are
/// on stems. They take some hundred times the memory of the rest.
void keep_what_matches(stem_map& map) {
  for (stem& s : map.stems) release(s.support);
  release(map.stem_samples);
  release(map.stem_normals);
  release(map.ground_samples);
  terrain without_heights;
  without_heights.status = map.terrain.status;
  without_heights.cut_off = map.terrain.cut_off;
  map.terrain = std::move(without_heights);
}

}  // namespace

survey_mapper::survey_mapper(const fs::path& folder, const shared_options& options, bool mixes_builds)
    : folder_(folder), options_(options), mixes_builds_(mixes_builds) {
  make_folder(folder);
}

stem_map_file::scan_record survey_mapper::record_of(const survey_input& input) const {
  return {input.name, input.hash, describe_mapping(options_), this_build().name(), instruction_set()};
}

std::optional<stem_map> survey_mapper::kept(const survey_input& input) const {
  std::ifstream in(file_of(input.name), std::ios::binary);
  if (!in) return std::nullopt;
  stem_map_file file;
  try {
    file = read_stem_map(in, stem_map_file::parts::stems);
  } catch (const std::runtime_error&) {  // damaged, or of another version: it is made again
    return std::nullopt;
  }
  const stem_map_file::scan_record record = record_of(input);
  if (file.provenance == record) return std::move(file.map);
  if (!mixes_builds_ && file.provenance.content_hash == record.content_hash &&
      file.provenance.options == record.options)
    require_this_build(file_of(input.name), file.provenance.version, file.provenance.processor);
  return std::nullopt;
}

survey_map survey_mapper::map(const survey_input& input, const execution& exec) const {
  survey_map result;
  result.error = input.error;
  if (!result.error.empty() || input.same_as) return result;
  if (auto map = kept(input)) {
    result.map = std::move(*map);
    keep_what_matches(result.map);
    result.was_kept = true;
    return result;
  }
  try {
    const scan_file scan = open_scan(input.path, options_.for_reading());
    for (const std::string& note : scan.header().notes) std::cerr << input.name << ": " << note << '\n';
    mapping_options mapping = options_.for_mapping();
    mapping.scanner.reset();  // surveys do not ask what scanners saw
    result.map = map_stems(scan, mapping, options_.up_direction(), exec);
  } catch (const file_error& e) {
    result.error = e.what();
    return result;
  } catch (const std::invalid_argument& e) {
    result.error = input.path.string() + ": " + e.what();
    return result;
  }
  if (result.map.cancelled) throw operation_cancelled();
  atomic_file file(file_of(input.name));
  write_stem_map(file.stream(), result.map, record_of(input));
  file.commit();
  keep_what_matches(result.map);
  return result;
}

stem_map survey_mapper::with_samples(const std::string& name) const {
  return read(name, stem_map_file::parts::all).map;
}

stem_map_file::scan_record survey_mapper::record_of(const std::string& name) const {
  return read(name, stem_map_file::parts::provenance).provenance;
}

stem_map_file survey_mapper::read(const std::string& name, stem_map_file::parts parts) const {
  std::ifstream in(file_of(name), std::ios::binary);
  try {
    if (in) return read_stem_map(in, parts);
  } catch (const std::runtime_error& e) {
    throw file_error(file_of(name), e.what(), "Remove it: the scan is then mapped again.");
  }
  throw file_error(file_of(name), "cannot be opened", "Run again: the scan is then mapped again.");
}

}  // namespace globalmatch::support

#include "support/programs/survey_refinement.hpp"

#include <globalmatch/stem_map_io.hpp>
#include <globalmatch/survey_refinement.hpp>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "support/atomic_file.hpp"
#include "support/build_record.hpp"
#include "support/programs/survey_maps.hpp"

namespace globalmatch::support {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;

namespace {

refinement_options refinement_of(const shared_options& options, const survey_work& work) {
  refinement_options result;
  if (work.control) result.without_samples = {*work.control};
  result.icp.metric = options.for_icp().metric;
  return result;
}

json describe_record(const stem_map_file::scan_record& record) {
  return {record.input, record.content_hash, record.options, record.version, record.processor};
}

/// All that a refined pair depends on, besides its start.
std::string describe_origin(const stem_map_file::scan_record& source,
                            const stem_map_file::scan_record& target, const refinement_options& options) {
  return json{{"version", this_build().name()},
              {"source", describe_record(source)},
              {"target", describe_record(target)},
              {"icp", options.icp.metric},
              {"max_points", options.icp.max_points}}
      .dump();
}

/// A pair that nothing was found of, as it would be written: its start alone.
std::string start_of(const pair_to_refine& start, const std::string& origin) {
  std::ostringstream bytes;
  refined_pair pair;
  pair.start = start;
  pair.provenance = origin;
  write_refined_pair(bytes, pair);
  return std::move(bytes).str();
}

/// The pair in a file, if it is of this start and origin.
std::optional<refined_pair> kept_pair(const fs::path& file, const pair_to_refine& start,
                                      const std::string& origin) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return std::nullopt;
  try {
    refined_pair pair = read_refined_pair(in);
    // Scans have other numbers where scans were added.
    pair.start.source = start.source;
    pair.start.target = start.target;
    if (start_of(pair.start, pair.provenance) == start_of(start, origin)) return pair;
  } catch (const std::runtime_error&) {  // damaged, or of another version: it is made again
  }
  return std::nullopt;
}

/// How scans lie beside the control, as the survey has it: this ties the heights that ground gives to its
/// own.
void add_starts_beside_control(const survey& s, std::size_t control, std::vector<refined_pair>& pairs) {
  if (s.scans[control].status != survey::status::placed) return;
  for (std::size_t scan = 0; scan < control; ++scan) {
    if (s.scans[scan].status != survey::status::placed ||
        s.scans[scan].component != s.scans[control].component)
      continue;
    refined_pair pair;
    pair.start = detail::placed_pair(s, scan, control);
    pair.target_from_source = pair.start.target_from_source;
    pair.uncertainty = detail::about(pair.start.uncertainty,
                                     pair.target_from_source * (s.scans[scan].survey_from_scan.inverse() *
                                                                s.scans[scan].uncertainty->center));
    pairs.push_back(std::move(pair));
  }
}

}  // namespace

std::vector<refined_pair> refine_pairs(const survey& s, const survey_work& work, const fs::path& out_dir,
                                       const shared_options& options, const execution& exec,
                                       std::size_t first, std::size_t step) {
  const refinement_options refinement = refinement_of(options, work);
  const std::vector<pair_to_refine> pairs = pairs_to_refine(s, refinement);
  const survey_mapper mapper(out_dir / "maps", options, true);
  make_folder(out_dir / "refined");
  const auto load = [&](std::size_t scan) { return mapper.with_samples(work.names[scan]); };
  detail::recent_maps maps(load);
  std::map<std::size_t, stem_map_file::scan_record> records;
  const auto record_of = [&](std::size_t scan) -> const stem_map_file::scan_record& {
    const auto found = records.find(scan);
    return found != records.end() ? found->second
                                  : records.emplace(scan, mapper.record_of(work.names[scan])).first->second;
  };
  std::vector<refined_pair> refined;
  for (std::size_t i = first; i < pairs.size(); i += step) {
    const pair_to_refine& start = pairs[i];
    const std::string origin = describe_origin(record_of(start.source), record_of(start.target), refinement);
    const fs::path path =
        out_dir / "refined" / (work.names[start.source] + "_on_" + work.names[start.target] + ".pair");
    if (auto kept = kept_pair(path, start, origin)) {
      refined.push_back(std::move(*kept));
      continue;
    }
    const auto source = maps(start.source), target = maps(start.target);
    refined.push_back(refine_pair(*source, *target, start, refinement, exec));
    refined.back().provenance = origin;
    atomic_file file(path);
    write_refined_pair(file.stream(), refined.back());
    file.commit();
  }
  return refined;
}

json refine(survey& s, const survey_work& work, const fs::path& out_dir, const shared_options& options,
            const execution& exec) {
  std::vector<refined_pair> pairs = refine_pairs(s, work, out_dir, options, exec);
  const auto by_icp = std::count_if(pairs.begin(), pairs.end(), [](const auto&p) { return p.is_refined; }),
             by_ground =
                 std::count_if(pairs.begin(), pairs.end(), [](const auto&p) { return p.is_height_refined; });
  const std::size_t count = pairs.size();
  if (work.control) add_starts_beside_control(s, *work.control, pairs);
  apply_refinements(s, pairs);
  std::cout << "refined " << by_icp << " of " << count << " pairs of scans by their stems, " << by_ground
            << " by their ground\n";
  return {{"pairs", count}, {"refined", by_icp}, {"heights_refined", by_ground}};
}

}  // namespace globalmatch::support

// Finds the true transforms of the scans of a folder, in the forms that published sets have.
#pragma once

#include "matrix_tables.hpp"
#include "scan_names.hpp"
#include "support/file_error.hpp"
#include "support/programs/near_names.hpp"
#include "support/scan_files.hpp"
#include "support/transform_files.hpp"
#include "support/wildcards.hpp"
#include "true_transforms.hpp"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

/// Where the truth is; all empty: where it is found. If some is given, no other is looked for.
struct truth_options {
  /// Names of the files of poses and of pairs, relative to the folder of the plot. {name} and {number} stand
  /// for those of a scan, {source} and {target} for two; * and ? for any others.
  std::string pose_files, pair_files;
  std::string table;     ///< as of `read_matrix_table`, relative to the folder of the plot
  bool headers = false;  ///< of PTX and E57
  bool inverse = false;  ///< matrices are scan_from_plot, source_from_target
  std::string root;      ///< the scan in whose frame the stems are, where the truth is of pairs

  bool is_given() const { return !pose_files.empty() || !pair_files.empty() || !table.empty() || headers; }
};

/// One form of truth that was found, perhaps of some scans only.
struct found_truth {
  std::string form;  ///< what it is, with an example of the files
  true_transforms transforms;
  std::vector<std::string> notes;  ///< what was left out
};

/// Looks for each form of truth.
class truth_search {
 public:
  truth_search(std::filesystem::path folder, std::vector<std::filesystem::path> scans,
               const truth_options& options)
      : folder_(std::move(folder)), scans_(std::move(scans)), names_(scans_), options_(options) {
    if (!options.root.empty()) root_ = require_scan(options.root);
  }

  const scan_names& names() const { return names_; }
  /// What was asked for or seen, but gave no truth.
  const std::vector<std::string>& unused() const { return unused_; }

  std::vector<found_truth> find() {
    const bool any = !options_.is_given();
    if (any) add_matrix_files();
    if (!options_.pose_files.empty()) add_named_pose_files();
    if (!options_.pair_files.empty()) add_named_pair_files();
    add_collected("4 x 4 matrices beside the scans");
    if (any) add_usual_tables();
    if (!options_.table.empty()) add_table(folder_ / options_.table);
    if (any || options_.headers) add_headers();
    return std::move(found_);
  }

  /// Throws `std::invalid_argument` when there is no such scan.
  std::size_t require_scan(const std::string& name) const {
    if (const auto scan = names_.find(name)) return *scan;
    throw std::invalid_argument("there is no scan " + name + " in " + folder_.string() + ": " +
                                support::suggest_name(name, names_.all()));
  }

 private:
  using optional_pose = std::optional<Eigen::Isometry3d>;

  Eigen::Isometry3d directed(const Eigen::Isometry3d& transform) const {
    return options_.inverse ? transform.inverse() : transform;
  }

  void add_pose(std::size_t scan, const Eigen::Isometry3d& read, const std::string& place) {
    const Eigen::Isometry3d pose = directed(read);
    poses_.resize(scans_.size());
    pose_places_.resize(scans_.size());
    if (poses_[scan] && difference(*poses_[scan], pose).is_contradiction())
      throw support::file_error(place,
                                "contradicts " + pose_places_[scan] + ": the poses differ by " +
                                    to_text(difference(*poses_[scan], pose)),
                                "Remove the one that is wrong, or name the other with --pose-files");
    if (poses_[scan]) return;
    poses_[scan] = pose;
    pose_places_[scan] = place;
  }

  void add_pair(std::pair<std::size_t, std::size_t> scans, const Eigen::Isometry3d& read,
                const std::string& place) {
    pairs_.push_back({scans.first, scans.second, directed(read), place});
  }

  void add_collected(const std::string& form) {
    if (!poses_.empty()) {
      const auto first = std::find_if(pose_places_.begin(), pose_places_.end(),
                                      [](const std::string& place) { return !place.empty(); });
      found_.push_back({form + ", a pose each (" + *first + " ...)", true_transforms(std::move(poses_)),
                        std::move(notes_)});
    }
    if (!pairs_.empty()) {
      const std::string example = pairs_.front().place;
      found_.push_back({form + ", of pairs (" + example + " ...)",
                        true_transforms(scans_.size(), std::move(pairs_), root_), std::move(notes_)});
    }
    unused_.insert(unused_.end(), notes_.begin(), notes_.end());  // empty where they were moved
    poses_.clear();
    pose_places_.clear();
    pairs_.clear();
    notes_.clear();
  }

  // Files like NAME.pose, pose_K.txt, NAME_pose.txt and A-B.pose.
  void add_matrix_files() {
    for (const auto& file : files_of(folder_)) {
      const std::string extension = support::lower_case(file.extension().string());
      if (extension != ".pose" && extension != ".txt") continue;
      if (std::find(scans_.begin(), scans_.end(), file) != scans_.end() || is_usual_table(file)) continue;
      const std::string name = file.stem().string();
      const bool is_matrix = extension == ".pose" || without_affixes(name) != name;
      const auto scan = scan_of(name);
      const auto pair = scan ? std::nullopt : pair_of(name);
      if (!scan && !pair) {
        if (is_matrix) notes_.push_back(file.string() + " is of no scan here");
        continue;
      }
      const auto transform = read_matrix(file, is_matrix || begins_with_number(file));
      if (!transform) continue;
      if (scan)
        add_pose(*scan, *transform, file.string());
      else
        add_pair(*pair, *transform, file.string());
    }
  }

  // A text beside a scan that bears its name may be anything unless it `is_matrix`.
  optional_pose read_matrix(const std::filesystem::path& file, bool is_matrix) {
    try {
      return support::read_transform(file);
    } catch (const support::file_error& error) {
      if (is_matrix) throw;
      unused_.push_back(error.what());
      return std::nullopt;
    }
  }

  static std::vector<std::filesystem::path> files_of(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    std::error_code error;
    for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
      if (at->is_regular_file() && !at->path().filename().string().starts_with('.'))
        files.push_back(at->path());
    std::sort(files.begin(), files.end());
    return files;
  }

  static bool begins_with_number(const std::filesystem::path& file) {
    std::ifstream in(file);
    std::string word;
    return in >> word && support::to_number(word);
  }

  // The name without what says that this is a pose.
  static std::string without_affixes(std::string name) {
    for (const std::string_view affix : {"pose", "transform", "truth", "gt", "T"}) {
      const std::string before = std::string(affix) + '_', after = '_' + std::string(affix);
      if (name.starts_with(before)) return name.substr(before.size());
      if (name.ends_with(after)) return name.substr(0, name.size() - after.size());
    }
    return name;
  }
  std::optional<std::size_t> scan_of(const std::string& name) const {
    const auto scan = names_.find(name);
    return scan ? scan : names_.find(without_affixes(name));
  }
  std::optional<std::pair<std::size_t, std::size_t>> pair_of(const std::string& name) const {
    const auto pair = names_.find_pair(name);
    return pair ? pair : names_.find_pair(without_affixes(name));
  }

  // The file that a pattern names; nothing where there is none.
  std::optional<std::filesystem::path> file_of(
      std::string pattern, const std::vector<std::pair<std::string, std::string>>& words) {
    for (const auto& [word, meaning] : words)
      for (std::size_t at = pattern.find(word); at != pattern.npos;
           at = pattern.find(word, at + meaning.size()))
        pattern.replace(at, word.size(), meaning);
    try {
      const auto files = support::expand_patterns({folder_ / pattern});
      if (files.size() > 1)
        throw std::invalid_argument(pattern + " matches " + std::to_string(files.size()) + " files in " +
                                    folder_.string() + ": write a pattern that matches one");
      std::error_code ignored;
      if (std::filesystem::is_regular_file(files[0], ignored)) return files[0];
    } catch (const support::file_error&) {  // matches nothing
    }
    return std::nullopt;
  }

  void add_named_pose_files() {
    for (std::size_t i = 0; i < scans_.size(); ++i)
      if (const auto file =
              file_of(options_.pose_files, {{"{name}", names_[i]}, {"{number}", trailing_number(names_[i])}}))
        add_pose(i, support::read_transform(*file), file->string());
    if (poses_.empty())
      unused_.push_back("no file has the name that --pose-files " + options_.pose_files + " gives");
  }

  void add_named_pair_files() {
    for (std::size_t i = 0; i < scans_.size(); ++i)
      for (std::size_t j = 0; j < scans_.size(); ++j) {
        if (i == j) continue;
        const auto file = file_of(options_.pair_files, {{"{source}", names_[i]},
                                                        {"{target}", names_[j]},
                                                        {"{source_number}", trailing_number(names_[i])},
                                                        {"{target_number}", trailing_number(names_[j])}});
        if (file) add_pair({i, j}, support::read_transform(*file), file->string());
      }
    if (pairs_.empty())
      unused_.push_back("no file has the name that --pair-files " + options_.pair_files + " gives");
  }

  static bool is_usual_table(const std::filesystem::path& file) {
    const std::string name = support::lower_case(file.stem().string());
    const std::string extension = support::lower_case(file.extension().string());
    const bool is_usual = name == "poses" || name == "pairs" || name == "truth" ||
                          support::matches(name, "ground*truth") || name == "gt" ||
                          support::matches(name, "transform*s");
    return is_usual && (extension == ".csv" || extension == ".txt" || extension == ".log");
  }

  void add_usual_tables() {
    for (const auto& file : files_of(folder_))
      if (is_usual_table(file)) add_table(file);
  }

  void add_table(const std::filesystem::path& file) {
    const std::vector<named_transform> entries = read_matrix_table(file);
    for (const named_transform& entry : entries) {
      if (first_names_count(entries) && !names_.find(entry.names[0]))
        throw support::file_error(entry.place,
                                  "is of " + entry.names[0] + ", which is no scan, in a column that counts",
                                  "Remove the column, or name it id in a header");
      std::vector<std::size_t> scans;
      for (const std::string& name : entry.names)
        if (const auto scan = names_.find(name))
          scans.push_back(*scan);
        else
          notes_.push_back(entry.place + " is of " + name + ", which is no scan here");
      if (scans.size() != entry.names.size()) continue;
      if (scans.size() == 1)
        add_pose(scans[0], entry.transform, entry.place);
      else if (scans[0] != scans[1])
        add_pair({scans[0], scans[1]}, entry.transform, entry.place);
    }
    add_collected("a table of matrices");
  }

  // Where all poses are the same, as in files that were never registered, they say nothing.
  void add_headers() {
    for (std::size_t i = 0; i < scans_.size(); ++i) {
      const std::string file = support::lower_case(support::parse_scan_name(scans_[i]).path.string());
      if (!file.ends_with(".ptx") && !file.ends_with(".e57")) continue;
      if (const optional_pose pose = support::open_scan(scans_[i]).header().pose)
        add_pose(i, *pose, scans_[i].string());
    }
    const auto is_first = [&](const optional_pose& pose) {
      return pose && poses_[0] && pose->matrix() == poses_[0]->matrix();
    };
    if (poses_.empty() && options_.headers)
      unused_.push_back("--header-poses: no header of a PTX or E57 file has a pose");
    if (!poses_.empty() && std::all_of(poses_.begin(), poses_.end(), is_first)) {
      unused_.push_back("the headers of all scans have the same pose");
      poses_.clear();
    }
    add_collected("headers of scan files");
  }

  std::filesystem::path folder_;
  std::vector<std::filesystem::path> scans_;
  scan_names names_;
  truth_options options_;
  std::size_t root_ = 0;
  std::vector<optional_pose> poses_;
  std::vector<std::string> pose_places_;
  std::vector<true_pair> pairs_;
  std::vector<std::string> notes_;
  std::vector<std::string> unused_;
  std::vector<found_truth> found_;
};

}  // namespace globalmatch::benchmarks

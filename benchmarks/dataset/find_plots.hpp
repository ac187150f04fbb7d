// Plots in folders: scans, and the truth about them.
#pragma once

#include "choose_truth.hpp"
#include "find_truth.hpp"
#include "stem_truth.hpp"
#include "support/file_error.hpp"
#include "support/scan_files.hpp"
#include "support/scan_sets.hpp"
#include "support/wildcards.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

/// What to look for in a folder.
struct dataset_options {
  std::string
      scans;  ///< pattern of their files, relative to the folder of the plot; empty: all known formats
  truth_options truth;
  std::string stems;   ///< file of true stems, relative to the folder of the plot; empty: the usual names
  std::string middle;  ///< name of the scan that others are registered with; empty: by the truth
};

/// A plot that lies in a folder.
struct stored_plot {
  std::string name;
  std::filesystem::path folder;
  std::vector<std::filesystem::path> scans;
  std::vector<std::string> names;
  true_transforms truth;
  std::string truth_form;  ///< for people
  std::vector<std::optional<stem_truth_file>> stems;
  std::size_t middle = 0;
  std::vector<std::string> notes;  ///< what is missing that can be done without
};

/// Whether a folder has files that are scans by their names.
inline bool has_scans(const std::filesystem::path& folder, const std::string& pattern) {
  if (pattern.empty()) return support::holds_scans(folder);
  try {
    return !support::expand_patterns({folder / pattern}).empty();
  } catch (const support::file_error&) {  // matches nothing
    return false;
  }
}

inline std::vector<std::filesystem::path> scans_of(const std::filesystem::path& folder,
                                                   const std::string& pattern) {
  return support::find_scans({pattern.empty() ? folder : folder / pattern});
}

/// The folder itself if it has scans, else its subfolders that have, by name. Throws `file_error` where there
/// are none.
inline std::vector<std::filesystem::path> folders_with_scans(const std::filesystem::path& folder,
                                                             const std::string& pattern) {
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error))
    throw support::file_error(folder, "is no folder", "Name the folder that holds the scans of a plot");
  if (has_scans(folder, pattern)) return {folder};
  std::vector<std::filesystem::path> folders;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    if (at->is_directory() && has_scans(at->path(), pattern)) folders.push_back(at->path());
  if (folders.empty())
    throw support::file_error(
        folder, "holds no scans, and no subfolder of it does",
        pattern.empty()
            ? "Scans have the extensions .ply .pcd .las .laz .e57 .ptx .pts .xyz; name others with "
              "--scans, as --scans \"scans/*.txt\""
            : "Correct --scans, which is relative to the folder of a plot");
  std::sort(folders.begin(), folders.end());
  return folders;
}

/// True stems of each scan. Those of a plot whose truth is of pairs are in the frame of a scan, which must be
/// known.
inline void add_stems(stored_plot& plot, const dataset_options& options) {
  std::size_t without = 0;
  std::string unused;
  for (const std::string& name : plot.names) {
    auto file = find_stem_truth(plot.folder, name, options.stems);
    if (file && !file->is_of_scan && plot.truth.is_of_pairs() && options.truth.root.empty()) {
      unused = file->path.string();
      file.reset();
    }
    // Read before anything is mapped, for what is wrong in it.
    if (file) read_stem_truth(*file, name, plot.truth.plot_from_scan(plot.stems.size()));
    without += !file;
    plot.stems.push_back(std::move(file));
  }
  if (!unused.empty())
    plot.notes.push_back(unused +
                         " is not used: pairs do not say in which frame it is; give --stems-in SCAN");
  if (without > 0)
    plot.notes.push_back("no true stems for " + std::to_string(without) + " of " +
                         std::to_string(plot.names.size()) +
                         " scans (stems.csv, or NAME_stems.csv in the frame of the scan): no precision and "
                         "recall, stems in common by the maps");
}

/// Scanners of a plot that are further apart than any scanner sees are most often in millimetres.
inline void add_distance_note(stored_plot& plot) {
  constexpr double most = 1000;  // [m]
  for (std::size_t i = 0; i < plot.names.size(); ++i) {
    const double distance = plot.truth.target_from_source(i, plot.middle).translation().norm();
    if (distance <= most) continue;
    plot.notes.push_back("the truth puts " + plot.names[i] + " " + std::to_string(std::llround(distance)) +
                         " m from " + plot.names[plot.middle] + ": is it in metres?");
    return;
  }
}

/// What a folder holds. Throws `file_error` where it cannot be evaluated.
inline stored_plot find_plot(const std::filesystem::path& folder, const dataset_options& options) {
  stored_plot plot;
  plot.folder = folder;
  std::error_code ignored;
  plot.name = std::filesystem::weakly_canonical(folder, ignored).filename().string();
  plot.scans = scans_of(folder, options.scans);
  if (plot.scans.size() < 2)
    throw support::file_error(folder, "holds one scan alone", "Put the scans of a plot into one folder");
  truth_search search(folder, plot.scans, options.truth);
  plot.names = search.names().all();
  for (const auto& scan : plot.scans)
    if (support::open_scan(scan).empty())
      throw support::file_error(scan, "holds no points", "Move it away, or export it again");
  for (std::size_t i = 0; i < plot.names.size(); ++i)
    if (std::find(plot.names.begin(), plot.names.begin() + std::ptrdiff_t(i), plot.names[i]) !=
        plot.names.begin() + std::ptrdiff_t(i))
      throw support::file_error(plot.scans[i], "has the name of another scan, but for its extension",
                                "Choose the files of one format with --scans, as --scans \"*.ply\"");
  found_truth truth = choose_truth(folder, search.find(), search.names(), search.unused());
  plot.truth = std::move(truth.transforms);
  plot.truth_form = std::move(truth.form);
  plot.notes = std::move(truth.notes);
  plot.middle = options.middle.empty() ? middle_scan(plot.truth) : search.require_scan(options.middle);
  add_distance_note(plot);
  add_stems(plot, options);
  return plot;
}

/// The plots of a folder. Throws `file_error` for the first one that cannot be evaluated.
inline std::vector<stored_plot> find_plots(const std::filesystem::path& folder,
                                           const dataset_options& options) {
  std::vector<stored_plot> plots;
  for (const auto& plot : folders_with_scans(folder, options.scans))
    plots.push_back(find_plot(plot, options));
  return plots;
}

/// Prints what was found, and what is missing. Whether all plots can be evaluated.
inline bool list_plots(const std::filesystem::path& folder, const dataset_options& options,
                       std::ostream& out) {
  bool is_complete = true;
  for (const auto& path : folders_with_scans(folder, options.scans)) {
    out << path.string() << '\n';
    try {
      const stored_plot plot = find_plot(path, options);
      for (std::size_t i = 0; i < plot.names.size(); ++i)
        out << "  scan  " << plot.names[i] << (i == plot.middle ? "  (the middle one)" : "")
            << (plot.stems[i] ? "  true stems: " + plot.stems[i]->path.filename().string() : "") << '\n';
      out << "  truth " << plot.truth_form << '\n';
      for (const std::string& note : plot.notes) out << "  note: " << note << '\n';
    } catch (const support::file_error& error) {
      for (const auto& scan : scans_of(path, options.scans))
        out << "  scan  " << support::name_of(scan) << '\n';
      out << "  problem: " << error.what() << '\n';
      is_complete = false;
    }
  }
  return is_complete;
}

}  // namespace globalmatch::benchmarks

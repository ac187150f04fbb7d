// Of the forms of truth that a folder has, the one to evaluate with; they must agree.
#pragma once

#include "find_truth.hpp"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace globalmatch::benchmarks {

/// The names of some scans, for messages.
inline std::string list_of(const std::vector<std::size_t>& scans, const scan_names& names) {
  std::string text;
  for (const std::size_t scan : scans) text += (text.empty() ? "" : ", ") + names[scan];
  return text;
}

/// The first of some notes, for the end of a message.
inline std::string first_of(const std::vector<std::string>& notes) {
  constexpr std::size_t most = 3;
  std::string text;
  for (std::size_t i = 0; i < std::min(most, notes.size()); ++i) text += "; " + notes[i];
  return text + (notes.size() > most ? "; and " + std::to_string(notes.size() - most) + " more" : "");
}

/// Throws `file_error` where chains of pairs contradict pairs.
inline void require_closed(const std::filesystem::path& folder, const found_truth& truth,
                           const scan_names& names) {
  const auto worst = worst_contradiction(truth.transforms);
  if (!worst) return;
  const bool is_inverse = !worst_contradiction(
      truth.transforms.with_each([](const Eigen::Isometry3d& transform) { return transform.inverse(); }));
  const auto& [pair, off] = *worst;
  throw support::file_error(pair.place,
                            "contradicts the chain of other pairs from " + names[pair.source] + " to " +
                                names[pair.target] + ": they differ by " + to_text(off),
                            is_inverse
                                ? "The matrices agree as those from target to source: give --inverse-truth"
                                : "Correct or remove the matrix that is wrong in " + folder.string());
}

/// The first form that has all scans. Throws `file_error` where no form has, where a form contradicts itself,
/// or two contradict each other.
inline found_truth choose_truth(const std::filesystem::path& folder, const std::vector<found_truth>& found,
                                const scan_names& names, const std::vector<std::string>& unused = {}) {
  if (found.empty())
    throw support::file_error(
        folder, "holds scans, but no truth of their places" + first_of(unused),
        "Put NAME.pose or pose_K.txt (4 x 4, plot from scan) or A-B.pose (from A to B) beside the scans, or "
        "poses.csv, or say where it is with --pose-files, --pair-files or --truth");
  const auto count_missing = [](const found_truth& t) { return t.transforms.without_pose().size(); };
  std::vector<found_truth> complete = found;
  std::erase_if(complete, [&](const found_truth& t) { return count_missing(t) > 0; });
  if (complete.empty()) {
    const auto best = std::min_element(
        found.begin(), found.end(),
        [&](const found_truth& a, const found_truth& b) { return count_missing(a) < count_missing(b); });
    throw support::file_error(
        folder,
        "has no truth for " + list_of(best->transforms.without_pose(), names) +
            ", which other scans have in " + best->form + first_of(best->notes) + first_of(unused),
        best->transforms.is_of_pairs() ? "Add a matrix to a scan that is connected, or move the scan away"
                                       : "Add the pose, or move the scan away");
  }
  for (const found_truth& truth : complete) require_closed(folder, truth, names);
  for (const found_truth& other : found) {
    transform_difference worst;
    const auto where = worst_difference(complete[0].transforms, other.transforms, worst);
    if (where && worst.is_contradiction())
      throw support::file_error(
          folder,
          "has two truths that contradict each other: " + complete[0].form + " and " + other.form +
              " differ by up to " + to_text(worst) + ", as from " + names[where->source] + " to " +
              names[where->target],
          "Name the right one with --pose-files, --pair-files, --truth or --header-poses");
  }
  return complete[0];
}

}  // namespace globalmatch::benchmarks

// What the registrations and stem maps of a plot say against its truth, which no table would show.
#pragma once

#include <globalmatch/evaluation.hpp>

#include "evaluated_scans.hpp"
#include "true_transforms.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace globalmatch::benchmarks {

/// A mistake that truths are published with, or read with.
struct truth_mistake {
  std::string_view text;  ///< completes "They agree with it ..."
  std::function<Eigen::Isometry3d(const Eigen::Isometry3d&)> mended;
};

inline std::vector<truth_mistake> truth_mistakes() {
  const auto scaled = [](double scale) {
    return [scale](Eigen::Isometry3d transform) {
      transform.translation() *= scale;
      return transform;
    };
  };
  const auto transposed = [](Eigen::Isometry3d transform) {
    transform.linear() = transform.linear().transpose().eval();
    return transform;
  };
  return {{"where its matrices are inverse: give --inverse-truth, or leave it out where it is given",
           [](const Eigen::Isometry3d& transform) { return transform.inverse(); }},
          {"where its rotations are transposed: write rotations row by row", transposed},
          {"where its lengths are millimetres: write metres", scaled(0.001)},
          {"where its lengths are centimetres: write metres", scaled(0.01)}};
}

/// What speaks against a truth, for people.
struct truth_doubts {
  std::vector<std::string> texts;
  bool is_refuted = false;  ///< several registrations contradict it and none agrees, or it is a known mistake
};

/// The known mistake, if any, without which more than half of the registered pairs agree with the truth.
template <class Agrees>
std::optional<truth_mistake> find_mistake(const true_transforms& truth,
                                          const std::vector<true_pair>& registered, const Agrees& agrees) {
  for (const truth_mistake& mistake : truth_mistakes()) {
    const true_transforms mended = truth.with_each(mistake.mended);
    const auto count = std::count_if(registered.begin(), registered.end(),
                                     [&](const true_pair& pair) { return agrees(mended, pair); });
    if (2 * std::size_t(count) > registered.size()) return mistake;
  }
  return std::nullopt;
}

/// `registered` are pairs as the program registered them; `agrees(truth, pair)` says whether one is right.
template <class Agrees>
truth_doubts doubts_of(const std::string& plot, const std::vector<std::string>& scans,
                       const true_transforms& truth, const std::vector<true_pair>& registered,
                       const Agrees& agrees) {
  truth_doubts doubts;
  std::vector<std::size_t> count(scans.size()), right(scans.size());
  std::size_t all_right = 0;
  for (const true_pair& pair : registered) {
    const bool is_right = agrees(truth, pair);
    all_right += is_right;
    for (const std::size_t scan : {pair.source, pair.target}) {
      ++count[scan];
      right[scan] += is_right;
    }
  }
  if (!registered.empty() && all_right == 0) {
    const auto mistake = find_mistake(truth, registered, agrees);
    doubts.is_refuted = mistake || registered.size() > 1;
    doubts.texts.push_back(plot + ": the truth contradicts all " + std::to_string(registered.size()) +
                           " registrations. " +
                           (mistake ? "They agree with it " + std::string(mistake->text)
                                    : "Look at its direction, unit, order of the scans and frame"));
    return doubts;
  }
  for (std::size_t scan = 0; scan < scans.size(); ++scan)
    if (count[scan] > 1 && right[scan] == 0)
      doubts.texts.push_back(plot + ": the truth of " + scans[scan] + " contradicts all " +
                             std::to_string(count[scan]) + " registrations of this scan, unlike others");
  return doubts;
}

/// Where next to no find is a true stem their frame or unit is wrong, as no mapping is that bad.
inline std::optional<std::string> doubt_of_stems(const std::string& plot,
                                                 const std::vector<map_score>& scores) {
  constexpr double min_precision = 0.1;
  const map_score sum = sum_of(scores);
  if (sum.found == 0 || double(sum.true_finds) >= min_precision * double(sum.found)) return std::nullopt;
  return plot + ": of " + std::to_string(sum.found) + " stems found " + std::to_string(sum.true_finds) +
         " stand at a true stem. Look at the frame of the true stems, and whether they are in metres";
}

}  // namespace globalmatch::benchmarks

#include "support/report/trust.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "support/programs/reports.hpp"
#include "support/report/html_parts.hpp"

namespace globalmatch::support {

namespace {

constexpr double coarse = 0.05;  // [m] errors that a forester sees in merged stems

std::string stems_matched(const matching& m) {
  return counted(m.funnel.correspondences) + " of " + counted(m.funnel.source_stems) + " and " +
         counted(m.funnel.target_stems);
}

/// What limits the use of a registration that was found.
std::vector<std::string> reservations(const registration& result, double horizontal) {
  std::vector<std::string> found;
  for (const warning& w : warnings_of(result.matching)) found.push_back(w.text + ".");
  if (horizontal > coarse)
    found.push_back("The stems fix the place coarsely: look at the section before trees are merged.");
  return found;
}

trust_statement of_registered(const registration& result, bool needs_height) {
  const matching& m = result.matching;
  const bool is_height_known = !m.vertical || m.vertical->is_known();
  const double horizontal = m.uncertainty ? horizontal_error(*m.uncertainty, m.uncertainty->center) : 0;
  trust_statement trust;
  trust.sentences = reservations(result, horizontal);
  if (!is_height_known && needs_height) {
    trust.headline = "Do not use it: the height is not known, and was required";
  } else if (!is_height_known) {
    trust.level = trust_level::partial;
    trust.headline = "Registered in plan: trust the position, not the height";
  } else if (!trust.sentences.empty()) {
    trust.level = trust_level::partial;
    trust.headline = "Registered, with reservations: read them before using it";
  } else {
    trust.level = trust_level::full;
    trust.headline = "Registered: the result can be trusted";
    trust.sentences.push_back("The stems agree on one transform, and no other explains them nearly as well.");
  }
  if (m.uncertainty)
    trust.figures.push_back(
        {"Expected error in plan", as_length(horizontal),
         std::string("standard error by the stems alone") + (result.refined ? "; ICP then refined it" : "")});
  if (m.vertical)
    trust.figures.push_back({"Expected error of the height",
                             as_length(is_height_known ? m.vertical->sigma : INFINITY),
                             is_height_known ? "by the " + std::string(to_string(m.vertical->source)) : ""});
  return trust;
}

trust_statement of_none(const registration& result) {
  trust_statement trust;
  if (result.outcome == outcome::ambiguous) {
    trust.headline = "Ambiguous: do not use it";
    trust.sentences.push_back(
        "Several transforms explain the stems about as well, and nothing tells which is right. They can be "
        "compared below.");
  } else {
    trust.headline = "Not registered: there is no result to use";
    trust.sentences.push_back("No transform brings enough stems of one scan onto those of the other.");
  }
  if (!result.reason.empty()) trust.sentences.push_back("Reason: " + result.reason + ".");
  trust.figures.push_back({"Expected error", "not known", "no transform was written"});
  return trust;
}

double median(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// Errors to expect of the scans in the largest component, and how far they were off where it was checked.
struct survey_errors {
  std::vector<double> expected, checked;

  explicit survey_errors(const survey& result) {
    for (const survey::scan& s : result.scans) {
      if (s.component != 0) continue;
      if (s.uncertainty && s.uncertainty->covariance(3, 3) > 0)  // 0: the reference
        expected.push_back(horizontal_error(*s.uncertainty, s.uncertainty->center));
      if (std::isfinite(s.check_median)) checked.push_back(s.check_median);
    }
  }
};

/// The usual one, and in its note the worst.
trust_figure figure_of(std::string_view label, const std::vector<double>& lengths, std::string_view note) {
  trust_figure figure{std::string(label), "not known"};
  if (lengths.empty()) return figure;
  figure.value = as_length(median(lengths));
  figure.note =
      "worst " + as_length(*std::max_element(lengths.begin(), lengths.end())) + "; " + std::string(note);
  return figure;
}

std::string named(const std::vector<std::string>& names) {
  constexpr std::size_t max_named = 10;
  std::string list;
  for (std::size_t i = 0; i < std::min(names.size(), max_named); ++i) list += (i ? ", " : "") + names[i];
  if (names.size() > max_named) list += " and " + counted(names.size() - max_named) + " others";
  return list;
}

/// What became of the scans that are not in the common frame, and why.
std::vector<std::string> reasons_of(const std::vector<const survey_row*>& missing) {
  constexpr std::size_t max_explained = 3;
  std::vector<std::string> names, sentences;
  for (const survey_row* row : missing) names.push_back(row->name);
  if (missing.empty()) return {};
  if (missing.size() > max_explained)
    return {"Not in the common frame: " + named(names) + ". Their reasons are below."};
  for (const survey_row* row : missing)
    sentences.push_back("Not in the common frame: " + row->name +
                        (row->reason.empty() ? "" : ", because " + row->reason) + ".");
  return sentences;
}

}  // namespace

double horizontal_error(const transform_uncertainty& uncertainty, const Eigen::Vector3d& place) {
  const Eigen::Matrix3d there = uncertainty.at(place);
  return std::sqrt(std::max(0.0, there.trace() - uncertainty.up.dot(there * uncertainty.up)));
}

trust_statement trust_in(const registration& result, bool needs_height) {
  trust_statement trust =
      result.outcome == outcome::registered ? of_registered(result, needs_height) : of_none(result);
  const bool has_hypothesis = !result.matching.hypotheses.empty();
  trust.figures.insert(
      trust.figures.begin(),
      {!has_hypothesis                         ? "Probability"
       : result.outcome == outcome::registered ? "Probability that it is right"
                                               : "Probability that the best hypothesis is right",
       has_hypothesis ? as_percentage(result.matching.probability) : "none"});
  trust.figures.push_back({"Stems matched", stems_matched(result.matching), "of source and target"});
  return trust;
}

trust_statement trust_in(const std::vector<survey_row>& rows, const survey& result) {
  std::vector<const survey_row*> missing;
  std::vector<std::string> coarse_ones;
  for (const survey_row& row : rows) {
    const bool is_placed = row.status == "placed" && row.scan && result.scans[*row.scan].component == 0;
    if (!is_placed)
      missing.push_back(&row);
    else if (result.scans[*row.scan].check_median > coarse)
      coarse_ones.push_back(row.name);
  }
  const std::size_t placed = rows.size() - missing.size();
  const survey_errors errors(result);
  trust_statement trust;
  const std::string count = counted(placed) + " of " + counted(rows.size()) + " scans";
  if (placed < 2) {
    trust.headline = "Not registered: no scans were placed beside each other";
  } else if (missing.empty() && coarse_ones.empty()) {
    trust.level = trust_level::full;
    trust.headline = "All " + counted(placed) + " scans are placed: the result can be trusted";
  } else {
    trust.level = trust_level::partial;
    trust.headline = missing.empty() ? "All scans are placed; look at some of them"
                                     : count + " are placed: trust these, not the others";
  }
  trust.sentences = reasons_of(missing);
  if (!coarse_ones.empty())
    trust.sentences.push_back("Placed, but their stems lie more than 5 cm from the trees of the others: " +
                              named(coarse_ones) + ".");
  trust.figures = {{"Placed in one frame", count},
                   figure_of("Expected error in plan", errors.expected, "standard error of a scan"),
                   figure_of("Independent check", errors.checked,
                             "stems from trees that had no say in where their scan was placed"),
                   {"Trees", counted(result.trees.size()), "seen by one scan or several"}};
  return trust;
}

}  // namespace globalmatch::support

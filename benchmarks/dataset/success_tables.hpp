// Running times, degrees of freedom, and success against overlap and common stems.
#pragma once

#include <globalmatch/detail/core/statistics.hpp>

#include "result_tables.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

/// What the figures of [GM] 5 show, as numbers.
class success_tables : result_tables {
 public:
  using result_tables::result_tables;

  void print() {
    print_times();
    if (results_.pairs.empty()) return;
    print_degrees_of_freedom();
    print_overlap();
    print_common();
  }

 private:
  void print_times() {
    title("Running times");
    note(
        "Mapping reads its points from the file in passes of its own, which counts. [GM] 5.3.2: 14.1 s for "
        "mapping and 0.6 s for matching on average.");
    std::vector<std::pair<double, double>> mapping, matching;
    std::vector<double> mapping_seconds, matching_seconds, icp_seconds;
    for (const scan_result& s : results_.scans) {
      mapping_seconds.push_back(s.seconds);
      if (s.stems > 0) mapping.push_back({double(s.stems), s.seconds});
    }
    for (const pair_result& p : results_.pairs) {
      matching_seconds.push_back(p.matching_seconds);
      if (p.fine) icp_seconds.push_back(p.icp_seconds);
      const double stems = std::sqrt(double(p.source_stems) * double(p.target_stems));
      if (stems > 0) matching.push_back({stems, p.matching_seconds});
    }
    print_head(out_, {"stage", "runs", "mean [s]", "median [s]", "maximum [s]", "exponent over stems"});
    const auto row = [&](const char* stage, std::vector<double> seconds, const std::string& grows) {
      if (seconds.empty()) return;
      const double most = *std::max_element(seconds.begin(), seconds.end());
      print_row(out_, {stage, std::to_string(seconds.size()), fixed(mean(seconds), 3),
                       fixed(detail::median(seconds), 3), fixed(most, 3), grows});
    };
    row("mapping a scan", mapping_seconds, exponent(mapping));
    row("matching a pair", matching_seconds, exponent(matching));
    row("ICP a pair", icp_seconds, "-");
  }

  void print_degrees_of_freedom() {
    title("4 and 6 degrees of freedom ([GM] 5.4.3)");
    note(
        "Coarse errors of all pairs that are right [cm], mean and median. [GM]: a mean horizontal error of "
        "1.5 cm with 4 degrees of freedom.");
    print_head(out_, {"degrees of freedom", "right", "3-D", "horizontal", "vertical"});
    for (const auto& [name, of] :
         {std::pair("4", &pair_result::four_dof), std::pair("6", &pair_result::six_dof)}) {
      std::vector<double> all, horizontal, vertical;
      for (const pair_result& p : results_.pairs) {
        const auto& run = p.*of;
        if (!run || !run->right()) continue;
        all.push_back(100 * run->error->pointwise);
        horizontal.push_back(100 * run->error->horizontal);
        vertical.push_back(100 * run->error->vertical);
      }
      table_row row = {name, std::to_string(all.size()) + " of " + std::to_string(results_.pairs.size())};
      for (auto* values : {&all, &horizontal, &vertical})
        row.push_back(fixed(mean(*values), 2) + ", " + fixed(detail::median(*values), 2));
      print_row(out_, row);
    }
  }

  // Success in bins of something that a pair has; the last bin is open.
  template <class Value>
  void print_bins(const std::string& what, const std::vector<double>& edges, int digits, const Value& value) {
    print_head(out_, {what, "pairs", "right [%]", "wrong", "refused"});
    for (std::size_t bin = 0; bin < edges.size(); ++bin) {
      const bool is_last = bin + 1 == edges.size();
      std::size_t count = 0, right = 0, wrong = 0;
      for (const pair_result& p : results_.pairs) {
        if (value(p) < edges[bin] || (!is_last && value(p) >= edges[bin + 1])) continue;
        ++count;
        right += p.right();
        wrong += p.wrong();
      }
      if (count > 0)
        print_row(out_, {"from " + fixed(edges[bin], digits) +
                             (is_last ? "" : " to below " + fixed(edges[bin + 1], digits)),
                         std::to_string(count), share(right, count), std::to_string(wrong),
                         std::to_string(count - right - wrong)});
    }
  }

  void print_overlap() {
    title("Success against overlap");
    note(
        "Overlap: stems in both maps over the stems in the smaller one. All pairs; intervals of 95 % "
        "confidence (Wilson).");
    print_bins("overlap", {0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9}, 1,
               [](const pair_result& p) { return p.overlap(); });
  }

  void print_common() {
    title("Success against common stems");
    print_bins("stems in both maps", {0, 3, 5, 8, 12, 20, 35, 60, 100}, 0,
               [](const pair_result& p) { return double(p.common); });
  }
};

}  // namespace globalmatch::benchmarks

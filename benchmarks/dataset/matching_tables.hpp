// Table 7 of [GM]: matching alone, by method and by the number of stems.
#pragma once

#include <globalmatch/detail/core/statistics.hpp>

#include "result_tables.hpp"

#include <cmath>
#include <cstddef>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

/// Errors from simplified stem maps; time and success against stems.
class matching_tables : result_tables {
 public:
  using result_tables::result_tables;

  void print() {
    print_matching();
    print_matching_sizes();
    print_common();
  }

 private:
  std::vector<std::size_t> sizes() const {
    std::set<std::size_t> sizes;
    for (const matching_result& run : results_.matchings)
      if (run.selection.count > 0) sizes.insert(run.selection.count);
    std::vector<std::size_t> ordered(sizes.begin(), sizes.end());
    ordered.push_back(0);
    return ordered;
  }

  void print_matching() {
    title("Matching alone, from simplified stem maps ([GM] table 7)");
    const std::size_t smallest = sizes().front();
    note("Scans on the middle one, " +
         (smallest == 0 ? "whole maps" : "maps of " + std::to_string(smallest) + " stems") +
         " that include the common ones first; means over those right. index is ours, with the options "
         "given; the "
         "others have the paper's 5 cm. Maps are taken as level: all turn about the vertical alone, ours, "
         "too, "
         "unless --dof is given.");
    print_plots(
        {"plot", "method", "right", "e_p [cm]", "e_R [mrad]", "e_t [cm]"},
        [&](const std::string& plot) {
          std::vector<table_row> rows;
          for (const std::string& method : methods_) {
            const mean_errors errors = of_method(plot, method, smallest);
            if (errors.count == 0) continue;
            rows.push_back({plot, method, errors.right()});
            errors.append_to(rows.back());
          }
          return rows;
        },
        [](const paper_plot& p) {
          std::vector<table_row> rows;
          for (const paper_matching& m : p.matchings) {
            rows.push_back({paper_name(p), std::string(m.name), "all"});
            append(rows.back(), m.coarse);
          }
          return rows;
        });
  }

  void print_matching_sizes() {
    note(
        "Time and success against the number of stems, all pairs; the exponent of time over stems is fitted "
        "to all runs of a method.");
    print_head(out_, {"method", "stems", "runs", "right [%]", "median seconds", "exponent"});
    for (const std::string& method : methods_) {
      std::vector<std::pair<double, double>> times;
      for (const matching_result& run : results_.matchings)
        if (run.method == method && run.seconds > 0 && run.selection.range == 0)
          times.push_back({stems_of(run), run.seconds});
      for (const std::size_t size : sizes()) {
        std::vector<double> seconds, stems;
        std::size_t right = 0;
        for (const matching_result& run : results_.matchings) {
          if (run.method != method || run.selection.count != size || run.selection.range > 0) continue;
          seconds.push_back(run.seconds);
          stems.push_back(stems_of(run));
          right += run.right();
        }
        if (seconds.empty()) continue;
        const std::size_t count = seconds.size();
        print_row(out_, {method, size == 0 ? "all, " + fixed(detail::median(stems), 0) : std::to_string(size),
                         std::to_string(count), share(right, count), fixed(detail::median(seconds), 4),
                         exponent(times)});
      }
    }
  }

  void print_common() {
    title("Success of matching alone against overlap and common stems");
    note(
        "Maps cut off at ranges around their scanners, and whole ones; all pairs, right [%], its interval of "
        "95 % confidence (Wilson), number of pairs, and how many of them are wrong. The others are refused.");
    print_bins("overlap", {0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8}, 1,
               [](const matching_result& run) { return run.overlap(); });
    print_bins("stems in both maps", {0, 3, 4, 5, 6, 7, 8, 10, 12, 15, 20, 30, 50, 100}, 0,
               [](const matching_result& run) { return double(run.common); });
  }

  // A row for each bin, a column for each method; the last bin is open.
  template <class Value>
  void print_bins(const std::string& what, const std::vector<double>& edges, int digits, const Value& value) {
    table_row head = {what};
    head.insert(head.end(), methods_.begin(), methods_.end());
    print_head(out_, head);
    for (std::size_t bin = 0; bin < edges.size(); ++bin) {
      const double end = bin + 1 < edges.size() ? edges[bin + 1] : std::numeric_limits<double>::infinity();
      table_row row = {"from " + fixed(edges[bin], digits) +
                       (std::isinf(end) ? "" : " to below " + fixed(end, digits))};
      std::size_t all = 0;
      for (const std::string& method : methods_) {
        std::size_t count = 0, right = 0, wrong = 0;
        for (const matching_result& run : results_.matchings) {
          if (run.method != method || run.selection.count > 0) continue;
          if (value(run) < edges[bin] || value(run) >= end) continue;
          ++count;
          right += run.right();
          wrong += run.wrong();
        }
        all += count;
        row.push_back(
            share(right, count) +
            (count == 0 ? "" : " of " + std::to_string(count) + ", " + std::to_string(wrong) + " wrong"));
      }
      if (all > 0) print_row(out_, row);
    }
  }

  static double stems_of(const matching_result& run) {
    return std::sqrt(double(run.source_stems) * double(run.target_stems));
  }
};

}  // namespace globalmatch::benchmarks

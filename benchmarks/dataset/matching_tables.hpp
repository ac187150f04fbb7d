// Table 7 of [GM]: matching alone, by method and by the number of stems.
#pragma once

#include <globalmatch/detail/core/statistics.hpp>

#include "result_tables.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
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
  }

 private:
  std::vector<std::size_t> sizes() const {
    std::set<std::size_t> sizes;
    for (const matching_result& run : results_.matchings)
      if (run.size > 0) sizes.insert(run.size);
    std::vector<std::size_t> ordered(sizes.begin(), sizes.end());
    ordered.push_back(0);
    return ordered;
  }

  void print_matching() {
    title("Matching alone, from simplified stem maps ([GM] table 7)");
    const std::size_t smallest = sizes().front();
    note("Scans on the middle one, " +
         (smallest == 0 ? "whole maps" : "maps of " + std::to_string(smallest) + " stems") +
         " that include the common ones first; means over those right.");
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
        if (run.method == method && run.seconds > 0) times.push_back({stems_of(run), run.seconds});
      for (const std::size_t size : sizes()) {
        std::vector<double> seconds, stems;
        std::size_t right = 0;
        for (const matching_result& run : results_.matchings) {
          if (run.method != method || run.size != size) continue;
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

  static double stems_of(const matching_result& run) {
    return std::sqrt(double(run.source_stems) * double(run.target_stems));
  }
};

}  // namespace globalmatch::benchmarks

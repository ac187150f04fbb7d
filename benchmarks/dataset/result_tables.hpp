// What the tables of an evaluation share: rows by plot, the paper's beside them, shares and exponents.
#pragma once

#include "growth.hpp"
#include "markdown.hpp"
#include "paper_tables.hpp"
#include "results.hpp"
#include "wilson.hpp"

#include <algorithm>
#include <cstddef>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

/// Prints tables of results to a stream.
class result_tables {
 public:
  result_tables(std::ostream& out, const dataset_results& results) : out_(out), results_(results) {
    for (const matching_result& run : results.matchings)
      if (std::find(methods_.begin(), methods_.end(), run.method) == methods_.end())
        methods_.push_back(run.method);
  }

 protected:
  void title(const std::string& text) { out_ << "\n## " << text << "\n"; }
  void note(const std::string& text) { out_ << '\n' << text << '\n'; }
  static std::string paper_name(const paper_plot& plot) { return "*" + std::string(plot.name) + "*"; }

  template <class Result>
  static std::vector<Result> of_plot(const std::vector<Result>& all, const std::string& plot) {
    std::vector<Result> own;
    for (const Result& result : all)
      if (result.plot == plot) own.push_back(result);
    return own;
  }

  // The paper's rows: those of plots of its names beside them, `row` makes one; then all of its plots.
  template <class Row>
  void print_paper(const table_row& head, const Row& row) {
    note("The paper's own data, [GM]:");
    print_head(out_, head);
    for (const paper_plot& plot : paper_plots)
      for (const table_row& cells : row(plot)) print_row(out_, cells);
  }

  // Prints the rows of each plot, and below them those that the paper has of a plot of that name.
  template <class Row, class PaperRow>
  void print_plots(const table_row& head, const Row& row, const PaperRow& paper_row) {
    print_head(out_, head);
    for (const std::string& plot : results_.plots) {
      for (const table_row& cells : row(plot)) print_row(out_, cells);
      if (const paper_plot* known = find_paper_plot(plot))
        for (const table_row& cells : paper_row(*known)) print_row(out_, cells);
    }
    print_paper(head, paper_row);
  }

  // Means over the pairs that are right, in the paper's units.
  struct mean_errors {
    std::vector<double> e_p, e_R, e_t;
    std::size_t count = 0, count_right = 0;  // of all pairs

    void add(const registration_error& e) {
      e_p.push_back(100 * e.pointwise);
      e_R.push_back(1000 * e.rotation);
      e_t.push_back(100 * e.translation);
    }
    std::string right() const {
      return std::to_string(count_right) + " of " + std::to_string(count) +
             (e_p.size() < count_right ? ", errors of " + std::to_string(e_p.size()) : "");
    }
    void append_to(table_row& row) const {
      for (const auto* values : {&e_p, &e_R, &e_t}) row.push_back(fixed(mean(*values), 2));
    }
  };
  static void append(table_row& row, const paper_errors& e) {
    for (const double value : {e.e_p, e.e_R, e.e_t}) row.push_back(fixed(value, 1));
  }

  mean_errors with_middle(const std::string& plot, bool fine) const {
    mean_errors errors;
    for (const pair_result& p : results_.pairs) {
      if (p.plot != plot || !p.with_middle) continue;
      ++errors.count;
      errors.count_right += p.right();
      if (const auto& e = fine ? p.fine : p.coarse; p.right() && e) errors.add(*e);  // no ICP: none fine
    }
    return errors;
  }
  mean_errors of_method(const std::string& plot, const std::string& method, std::size_t size) const {
    mean_errors errors;
    for (const matching_result& run : results_.matchings) {
      if (run.plot != plot || run.method != method || !run.with_middle) continue;
      if (run.selection.count != size || run.selection.range > 0) continue;
      ++errors.count;
      errors.count_right += run.right();
      if (run.right()) errors.add(*run.error);
    }
    return errors;
  }

  // Right of all, as a share with its interval.
  static std::string share(std::size_t right, std::size_t count) {
    if (count == 0) return "-";
    const interval range = wilson_interval(right, count);
    return fixed(100 * double(right) / double(count), 0) + " (" + fixed(100 * range.low, 0) + " to " +
           fixed(100 * range.high, 0) + ")";
  }

  // Fitted where the sizes differ by a factor of two or more; elsewhere it would be of noise.
  static std::string exponent(const std::vector<std::pair<double, double>>& times) {
    if (times.empty()) return "-";
    const auto [least, most] = std::minmax_element(times.begin(), times.end());
    return most->first >= 2 * least->first ? fixed(growth_exponent(times), 2) : "-";
  }

  std::ostream& out_;
  const dataset_results& results_;
  std::vector<std::string> methods_;  // that were run, in their order
};

}  // namespace globalmatch::benchmarks

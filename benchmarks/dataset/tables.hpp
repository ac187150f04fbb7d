// The tables of [GM] 5 from results, those of the paper's own data below each.
#pragma once

#include <globalmatch/detail/core/statistics.hpp>

#include "growth.hpp"
#include "markdown.hpp"
#include "paper_tables.hpp"
#include "results.hpp"
#include "wilson.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <ostream>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

/// Prints tables.md.
class table_printer {
 public:
  table_printer(std::ostream& out, const dataset_results& results, const std::set<int>& tables)
      : out_(out), results_(results), tables_(tables) {
    for (const matching_result& run : results.matchings)
      if (std::find(methods_.begin(), methods_.end(), run.method) == methods_.end())
        methods_.push_back(run.method);
  }

  void print() {
    if (has(2)) print_stem_mapping();
    if (has(3)) print_fine_errors();
    if (has(4)) print_coarse_errors();
    if (has(5)) print_success();
    if (has(6)) print_verticality();
    if (has(7)) print_matching();
    print_times();
    if (!results_.pairs.empty()) {
      print_degrees_of_freedom();
      print_overlap();
      print_common();
    }
  }

 private:
  static constexpr const char* of_paper = "*[GM], its data*";

  bool has(int table) const { return tables_.contains(table); }
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

  void print_stem_mapping() {
    title("Stem mapping ([GM] table 2)");
    const auto row = [&](const std::string& plot) {
      std::vector<map_score> scores;
      std::vector<double> stems, seconds;
      for (const scan_result& s : of_plot(results_.scans, plot)) {
        if (s.score) scores.push_back(*s.score);
        stems.push_back(double(s.stems));
        seconds.push_back(s.seconds);
      }
      const map_score sum = sum_of(scores);
      const auto percent = [&](double share) { return scores.empty() ? "-" : fixed(100 * share, 1); };
      return std::vector<table_row>{{plot, std::to_string(stems.size()), percent(sum.precision()),
                                     percent(sum.recall()), percent(sum.f1()), fixed(mean(stems), 0),
                                     fixed(mean(seconds), 2)}};
    };
    const auto paper_row = [](const paper_plot& p) {
      return std::vector<table_row>{{paper_name(p), "-", fixed(p.precision, 1), fixed(p.recall, 1),
                                     fixed(p.f1, 1), "-", fixed(p.seconds, 1)}};
    };
    print_plots({"plot", "scans", "precision [%]", "recall [%]", "F1 [%]", "stems a scan", "seconds a scan"},
                row, paper_row);
  }

  // Means over the pairs that are right, in the paper's units.
  struct mean_errors {
    std::vector<double> e_p, e_R, e_t;
    std::size_t count = 0;  // of all pairs

    void add(const registration_error& e) {
      e_p.push_back(100 * e.pointwise);
      e_R.push_back(1000 * e.rotation);
      e_t.push_back(100 * e.translation);
    }
    std::string right() const { return std::to_string(e_p.size()) + " of " + std::to_string(count); }
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
      if (const auto& e = fine ? p.fine : p.coarse; p.right() && e) errors.add(*e);
    }
    return errors;
  }
  mean_errors of_method(const std::string& plot, const std::string& method, std::size_t size) const {
    mean_errors errors;
    for (const matching_result& run : results_.matchings) {
      if (run.plot != plot || run.method != method || run.size != size || !run.with_middle) continue;
      ++errors.count;
      if (run.right()) errors.add(*run.error);
    }
    return errors;
  }

  void print_fine_errors() {
    title("Fine registration ([GM] table 3)");
    note("Scans on the middle one, means over those registered with e_p below 50 cm.");
    print_plots(
        {"plot", "right", "e_p [cm]", "e_R [mrad]", "e_t [cm]"},
        [&](const std::string& plot) {
          const mean_errors errors = with_middle(plot, true);
          table_row row = {plot, errors.right()};
          errors.append_to(row);
          return std::vector<table_row>{row};
        },
        [](const paper_plot& p) {
          table_row row = {paper_name(p), "all"};
          append(row, p.methods.back().fine);
          return std::vector<table_row>{row};
        });
  }

  void print_coarse_errors() {
    title("Coarse and fine registration ([GM] table 4)");
    note("As above. Methods besides ours match the same, whole stem maps, as far as they bear their size.");
    const auto row = [&](const std::string& plot) {
      const mean_errors coarse = with_middle(plot, false);
      std::vector<table_row> rows = {{plot, "ours", coarse.right()}};
      coarse.append_to(rows[0]);
      with_middle(plot, true).append_to(rows[0]);
      for (const std::string& method : methods_) {
        const mean_errors errors = of_method(plot, method, 0);
        if (errors.count == 0) continue;
        rows.push_back({plot, method, errors.right()});
        errors.append_to(rows.back());
        rows.back().insert(rows.back().end(), 3, "-");
      }
      return rows;
    };
    const auto paper_row = [](const paper_plot& p) {
      std::vector<table_row> rows;
      for (const paper_method& method : p.methods) {
        rows.push_back({paper_name(p), std::string(method.name), "all"});
        append(rows.back(), method.coarse);
        append(rows.back(), method.fine);
      }
      return rows;
    };
    print_plots({"plot", "method", "right", "coarse e_p [cm]", "e_R [mrad]", "e_t [cm]", "fine e_p [cm]",
                 "e_R [mrad]", "e_t [cm]"},
                row, paper_row);
  }

  // Right of all, as a share with its interval.
  static std::string share(std::size_t right, std::size_t count) {
    if (count == 0) return "-";
    const interval range = wilson_interval(right, count);
    return fixed(100 * double(right) / double(count), 0) + " (" + fixed(100 * range.low, 0) + " to " +
           fixed(100 * range.high, 0) + ")";
  }

  table_row success_row(const std::string& name, bool is_all) const {
    std::size_t count = 0, right = 0, wrong = 0;
    for (const pair_result& p : results_.pairs) {
      if (!is_all && p.plot != name) continue;
      ++count;
      right += p.right();
      wrong += p.wrong();
    }
    table_row row = {name, std::to_string(count), share(right, count), std::to_string(wrong),
                     std::to_string(count - right - wrong)};
    for (const std::string& method : methods_) {
      std::size_t runs = 0, runs_right = 0;
      for (const matching_result& run : results_.matchings) {
        if ((!is_all && run.plot != name) || run.method != method || run.size != 0) continue;
        ++runs;
        runs_right += run.right();
      }
      row.push_back(share(runs_right, runs) +
                    (runs > 0 && runs < count ? ", " + std::to_string(runs) + " pairs" : ""));
    }
    return row;
  }

  void print_success() {
    title("Success of coarse registration, all pairs ([GM] table 5)");
    note(
        "Right: registered, e_p below 50 cm; with the interval of 95 % confidence (Wilson). A pair that is "
        "refused is no success. Methods match whole stem maps.");
    table_row head = {"plot", "pairs", "ours right [%]", "wrong", "refused"};
    for (const std::string& method : methods_) head.push_back(method + " right [%]");
    print_head(out_, head);
    for (const std::string& plot : results_.plots) print_row(out_, success_row(plot, false));
    print_row(out_, success_row("all", true));
    note("The paper's own data, [GM]:");
    table_row paper_head = {"plot"};
    for (const paper_method& method : paper_plots[0].methods)
      paper_head.push_back(std::string(method.name) + " [%]");
    print_head(out_, paper_head);
    for (const paper_plot& p : paper_plots) {
      table_row row = {paper_name(p)};
      for (const paper_method& method : p.methods) row.push_back(fixed(method.success, 0));
      print_row(out_, row);
    }
  }

  void print_verticality() {
    title("Stem mapping with and without the verticality constraint ([GM] table 6)");
    const auto row = [&](const std::string& plot) {
      std::vector<double> stems[2], seconds[2], e_p[2];
      std::size_t right[2] = {}, count = 0;
      for (const scan_result& s : of_plot(results_.scans, plot)) {
        stems[0].push_back(double(s.stems));
        seconds[0].push_back(s.seconds);
        if (!s.without_stems) continue;
        stems[1].push_back(double(*s.without_stems));
        seconds[1].push_back(s.without_seconds);
      }
      for (const pair_result& p : of_plot(results_.pairs, plot)) {
        ++count;
        const auto& run = p.without_verticality;
        const bool is_right[2] = {p.right(), run && run->right()};
        for (const int k : {0, 1}) right[k] += is_right[k];
        if (p.with_middle && is_right[0]) e_p[0].push_back(100 * p.coarse->pointwise);
        if (p.with_middle && is_right[1]) e_p[1].push_back(100 * run->error->pointwise);
      }
      std::vector<table_row> rows;
      for (const int k : {0, 1})
        rows.push_back({plot, k == 0 ? "with" : "without", fixed(mean(stems[k]), 0),
                        fixed(mean(seconds[k]), 2), share(right[k], count), fixed(mean(e_p[k]), 2)});
      return rows;
    };
    const auto paper_row = [](const paper_plot& p) {
      return std::vector<table_row>{
          {paper_name(p), "with", "-", fixed(p.seconds, 1), "100", fixed(p.coarse_e_p, 1)},
          {paper_name(p), "without", "-", fixed(p.seconds_without, 1), "100",
           fixed(p.coarse_e_p_without, 1)}};
    };
    print_plots(
        {"plot", "constraint", "stems a scan", "seconds a scan", "right [%], all pairs", "coarse e_p [cm]"},
        row, paper_row);
  }

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
    print_matching_sizes();
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
                         fixed(growth_exponent(times), 2)});
      }
    }
  }

  static double stems_of(const matching_result& run) {
    return std::sqrt(double(run.source_stems) * double(run.target_stems));
  }

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
    const auto row = [&](const char* stage, std::vector<double> seconds, double exponent) {
      if (seconds.empty()) return;
      const double most = *std::max_element(seconds.begin(), seconds.end());
      print_row(out_, {stage, std::to_string(seconds.size()), fixed(mean(seconds), 3),
                       fixed(detail::median(seconds), 3), fixed(most, 3), fixed(exponent, 2)});
    };
    row("mapping a scan", mapping_seconds, growth_exponent(mapping));
    row("matching a pair", matching_seconds, growth_exponent(matching));
    row("ICP a pair", icp_seconds, std::nan(""));
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

  std::ostream& out_;
  const dataset_results& results_;
  const std::set<int>& tables_;
  std::vector<std::string> methods_;
};

}  // namespace globalmatch::benchmarks

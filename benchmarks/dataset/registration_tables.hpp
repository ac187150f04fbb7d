// Tables 2 to 6 of [GM]: stem mapping and registration.
#pragma once

#include "result_tables.hpp"

#include <cstddef>
#include <set>
#include <string>
#include <vector>

namespace globalmatch::benchmarks {

/// Stem mapping, errors, success, and the verticality constraint.
class registration_tables : result_tables {
 public:
  using result_tables::result_tables;

  void print(const std::set<int>& tables) {
    if (tables.contains(2)) print_stem_mapping();
    if (tables.contains(3)) print_fine_errors();
    if (tables.contains(4)) print_coarse_errors();
    if (tables.contains(5)) print_success();
    if (tables.contains(6)) print_verticality();
  }

 private:
  void print_stem_mapping() {
    title("Stem mapping ([GM] table 2)");
    note("Seconds of ours are of a scan; [GM] does not say whether its own are.");
    const auto row = [&](const std::string& plot) {
      std::vector<map_score> scores;
      std::vector<double> stems, seconds;
      for (const scan_result& s : of_plot(results_.scans, plot)) {
        if (s.score) scores.push_back(*s.score);
        stems.push_back(double(s.stems));
        seconds.push_back(s.seconds);
      }
      const map_score sum = sum_of(scores);
      const auto percent = [](bool is_known, double share) { return is_known ? fixed(100 * share, 1) : "-"; };
      const bool has_required = sum.required > 0;
      return std::vector<table_row>{{plot, std::to_string(stems.size()),
                                     percent(!scores.empty(), sum.precision()),
                                     percent(has_required, sum.recall()), percent(has_required, sum.f1()),
                                     fixed(mean(stems), 0), fixed(mean(seconds), 2)}};
    };
    const auto paper_row = [](const paper_plot& p) {
      return std::vector<table_row>{{paper_name(p), "-", fixed(p.precision, 1), fixed(p.recall, 1),
                                     fixed(p.f1, 1), "-", fixed(p.seconds, 1)}};
    };
    print_plots({"plot", "scans", "precision [%]", "recall [%]", "F1 [%]", "stems a scan", "seconds a scan"},
                row, paper_row);
  }

  void print_fine_errors() {
    title("Fine registration ([GM] table 3)");
    note(
        "Scans on the middle one, means over those registered with e_p below 50 cm, where ICP ran and "
        "converged.");
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
    note(
        "As above. Methods besides ours match the same, whole stem maps, as far as they bear their size; no "
        "ICP follows theirs, so that their fine columns are empty.");
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
        if ((!is_all && run.plot != name) || run.method != method || !run.selection.is_whole()) continue;
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
};

}  // namespace globalmatch::benchmarks

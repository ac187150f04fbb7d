// What an evaluation found: by scan, by pair, by run of a matcher; and the CSV files of it.
#pragma once

#include <globalmatch/evaluation.hpp>

#include "evaluated_pairs.hpp"
#include "stem_selection.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace globalmatch::benchmarks {

struct scan_result {
  std::string plot, scan;
  std::size_t points = 0, stems = 0;
  double seconds = 0;                             ///< of mapping
  std::optional<map_score> score = {};            ///< where true stems are known
  std::optional<std::size_t> without_stems = {};  ///< without the verticality constraint
  double without_seconds = 0;
};

/// A coarse registration with fixed options: whether it was registered, and the errors of its best transform.
struct coarse_run {
  bool is_registered = false;
  std::optional<registration_error> error;

  bool right() const { return is_registered && error->success(); }
};

struct pair_result : evaluated_pair {
  std::string plot = {}, source = {}, target = {};
  bool with_middle = false;    ///< the target is the middle scan
  double distance = 0;         ///< [m] between the scanners
  std::size_t common = 0;      ///< stems in both maps
  double mapping_seconds = 0;  ///< of both scans
  std::optional<coarse_run> four_dof = {}, six_dof = {}, without_verticality = {};

  /// Stems in both maps over those in the smaller map.
  double overlap() const {
    const std::size_t smaller = std::min(source_stems, target_stems);
    return smaller > 0 ? double(common) / double(smaller) : 0;
  }
};

/// One way to match, on the stem maps of a pair or on parts of them.
struct matching_result {
  std::string plot, source, target;
  bool with_middle = false;
  std::string method = {};
  stem_selection selection = {};
  std::size_t source_stems = 0, target_stems = 0, common = 0;
  double seconds = 0;
  std::optional<registration_error> error = {};  ///< where it returned a transform

  bool right() const { return error && error->success(); }
  bool wrong() const { return error && !error->success(); }
  /// Stems in both maps over those in the smaller map.
  double overlap() const { return double(common) / double(std::min(source_stems, target_stems)); }
};

struct dataset_results {
  std::vector<std::string> plots;  ///< in their order
  std::vector<scan_result> scans;
  std::vector<pair_result> pairs;
  std::vector<matching_result> matchings;
  std::vector<std::string> doubts;  ///< what speaks against the truth, which all other numbers rest on
  bool truth_is_refuted = false;    ///< of a plot
};

/// A name as a field of CSV.
inline std::string csv_field(const std::string& name) {
  if (name.find_first_of(",\"\n") == name.npos) return name;
  std::string field = "\"";
  for (const char c : name) field += c == '"' ? std::string("\"\"") : std::string(1, c);
  return field + '"';
}

inline void write_scans(std::ostream& out, const std::vector<scan_result>& scans) {
  out << "plot,scan,points,stems,mapping_seconds,true_finds,required,required_found,precision,recall,f1,"
         "no_verticality_stems,no_verticality_seconds\n";
  for (const scan_result& s : scans) {
    out << csv_field(s.plot) << ',' << csv_field(s.scan) << ',' << s.points << ',' << s.stems << ','
        << s.seconds << ',';
    if (s.score)
      out << s.score->true_finds << ',' << s.score->required << ',' << s.score->required_found << ','
          << s.score->precision() << ',';
    else
      out << ",,,,";
    if (s.score && s.score->required > 0)
      out << s.score->recall() << ',' << s.score->f1() << ',';
    else
      out << ",,";
    if (s.without_stems)
      out << *s.without_stems << ',' << s.without_seconds << '\n';
    else
      out << ",\n";
  }
}

inline void write_coarse_run(std::ostream& out, const std::optional<coarse_run>& run) {
  if (!run)
    out << ",,,,";
  else if (!run->error)
    out << ",0,,,";
  else
    out << ',' << run->right() << ',' << run->error->pointwise << ',' << run->error->horizontal << ','
        << run->error->vertical;
}

inline void write_pairs(std::ostream& out, const std::vector<pair_result>& pairs) {
  out << "plot,source,target,with_middle,distance,common,overlap,right,mapping_seconds,"
      << evaluated_pair_columns;
  for (const char* run : {"dof4", "dof6", "no_verticality"})
    for (const char* column : {"right", "e_p", "horizontal", "vertical"}) out << ',' << run << '_' << column;
  out << '\n';
  for (const pair_result& p : pairs) {
    out << csv_field(p.plot) << ',' << csv_field(p.source) << ',' << csv_field(p.target) << ','
        << p.with_middle << ',' << p.distance << ',' << p.common << ',' << p.overlap() << ',' << p.right()
        << ',' << p.mapping_seconds << ',';
    write_fields(out, p);
    for (const auto& run : {p.four_dof, p.six_dof, p.without_verticality}) write_coarse_run(out, run);
    out << '\n';
  }
}

inline void write_matchings(std::ostream& out, const std::vector<matching_result>& runs) {
  out << "plot,source,target,with_middle,method,size,range,source_stems,target_stems,common,seconds,found,"
         "right,"
         "e_p,e_R,e_t\n";
  for (const matching_result& r : runs) {
    out << csv_field(r.plot) << ',' << csv_field(r.source) << ',' << csv_field(r.target) << ','
        << r.with_middle << ',' << r.method << ','
        << (r.selection.count == 0 ? "all" : std::to_string(r.selection.count)) << ',';
    if (r.selection.range > 0) out << r.selection.range;
    out << ',' << r.source_stems << ',' << r.target_stems << ',' << r.common << ',' << r.seconds << ','
        << r.error.has_value() << ',' << r.right() << ',';
    if (r.error)
      out << r.error->pointwise << ',' << r.error->rotation << ',' << r.error->translation << '\n';
    else
      out << ",,\n";
  }
}

}  // namespace globalmatch::benchmarks

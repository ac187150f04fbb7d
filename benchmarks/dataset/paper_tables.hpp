// What [GM] (Wang et al. 2023) reports of its own data, to stand beside other results. Times are those of a
// laptop with an Intel Core i7 of 2.60 GHz, 8 threads.
#pragma once

#include <array>
#include <cctype>
#include <string>
#include <string_view>

namespace globalmatch::benchmarks {

/// Errors as the tables of [GM] have them.
struct paper_errors {
  double e_p, e_R, e_t;  // [cm], [mrad], [cm]
};

/// A method in tables 4 and 5.
struct paper_method {
  std::string_view name;
  paper_errors coarse, fine;
  double success;  // [%] of all pairs
};

/// A method in table 7, with simplified stem maps.
struct paper_matching {
  std::string_view name;
  paper_errors coarse;
};

struct paper_plot {
  std::string_view name;
  double precision, recall, f1;                // [%] table 2
  std::array<paper_method, 4> methods;         // tables 3 (the last, fine), 4 and 5
  double seconds, coarse_e_p;                  // table 6, with the verticality constraint
  double seconds_without, coarse_e_p_without;  // table 6, without
  std::array<paper_matching, 3> matchings;     // table 7
};

constexpr double paper_mapping_seconds = 14.1, paper_matching_seconds = 0.6;  // means, [GM] 5.3.2

constexpr std::array<paper_plot, 6> paper_plots = {{
    {"Plot #1",
     96.0,
     96.8,
     96.4,
     {{{"TOA", {11.0, 10.9, 8.7}, {0.7, 0.5, 0.7}, 100},
       {"Fast-TOA", {9.4, 9.2, 6.7}, {0.7, 0.5, 0.7}, 100},
       {"FMP+BnB", {9.1, 3.2, 8.8}, {0.7, 0.6, 0.7}, 50},
       {"GlobalMatch", {6.2, 0.7, 6.3}, {0.7, 0.5, 0.7}, 100}}},
     7.9,
     6.2,
     11.8,
     5.6,
     {{{"TOA", {11.0, 10.9, 8.7}}, {"Fast-TOA", {9.4, 9.2, 6.7}}, {"GlobalMatch", {4.4, 0.7, 4.5}}}}},
    {"Plot #2",
     97.6,
     96.2,
     96.9,
     {{{"TOA", {27.8, 22.4, 21.4}, {1.2, 1.2, 0.9}, 90},
       {"Fast-TOA", {27.3, 24.7, 19.7}, {1.5, 1.2, 1.2}, 80},
       {"FMP+BnB", {6.6, 2.5, 6.3}, {1.1, 1.2, 0.9}, 80},
       {"GlobalMatch", {6.2, 1.2, 6.0}, {1.3, 1.2, 1.0}, 100}}},
     12.2,
     6.2,
     94.1,
     13.4,
     {{{"TOA", {27.8, 22.4, 21.4}}, {"Fast-TOA", {27.3, 24.7, 19.7}}, {"GlobalMatch", {20.5, 2.0, 20.3}}}}},
    {"Plot #3",
     96.1,
     94.6,
     95.4,
     {{{"TOA", {1.4, 1.5, 1.3}, {0.7, 0.3, 0.8}, 100},
       {"Fast-TOA", {1.3, 1.3, 1.2}, {0.7, 0.3, 0.7}, 100},
       {"FMP+BnB", {3.5, 1.1, 3.5}, {1.1, 0.4, 1.0}, 90},
       {"GlobalMatch", {3.6, 0.5, 3.6}, {0.9, 0.3, 0.8}, 100}}},
     5.8,
     3.6,
     91.0,
     4.1,
     {{{"TOA", {1.4, 1.5, 1.3}}, {"Fast-TOA", {1.3, 1.3, 1.2}}, {"GlobalMatch", {3.2, 0.9, 3.2}}}}},
    {"Plot #4",
     92.9,
     95.5,
     94.2,
     {{{"TOA", {3.9, 3.6, 3.8}, {0.9, 0.3, 0.9}, 100},
       {"Fast-TOA", {3.7, 3.6, 3.5}, {0.9, 0.3, 0.9}, 100},
       {"FMP+BnB", {6.3, 1.8, 6.3}, {1.1, 0.4, 1.1}, 60},
       {"GlobalMatch", {3.1, 0.3, 3.1}, {1.0, 0.3, 1.0}, 100}}},
     6.5,
     3.1,
     38.4,
     2.6,
     {{{"TOA", {3.9, 3.6, 3.8}}, {"Fast-TOA", {3.7, 3.6, 3.5}}, {"GlobalMatch", {1.0, 0.3, 1.0}}}}},
    {"WHU-FGI",
     97.1,
     95.8,
     96.4,
     {{{"TOA", {7.6, 7.6, 5.5}, {1.7, 1.0, 1.5}, 100},
       {"Fast-TOA", {6.1, 7.5, 3.7}, {1.7, 1.0, 1.5}, 100},
       {"FMP+BnB", {7.3, 3.6, 6.9}, {1.4, 0.8, 1.2}, 70},
       {"GlobalMatch", {7.6, 0.6, 7.6}, {1.6, 0.9, 1.4}, 100}}},
     7.7,
     7.6,
     102.4,
     8.1,
     {{{"TOA", {7.6, 7.6, 5.5}}, {"Fast-TOA", {6.4, 7.5, 3.7}}, {"GlobalMatch", {5.0, 1.0, 5.0}}}}},
    {"ETH-Trees",
     90.8,
     93.4,
     92.1,
     {{{"TOA", {20.7, 22.8, 18.2}, {0.8, 0.9, 0.6}, 67},
       {"Fast-TOA", {22.2, 20.0, 20.0}, {0.8, 0.9, 0.7}, 87},
       {"FMP+BnB", {5.0, 3.6, 4.5}, {0.8, 0.9, 0.6}, 87},
       {"GlobalMatch", {8.7, 3.4, 8.6}, {0.8, 0.9, 0.6}, 100}}},
     6.1,
     8.7,
     85.6,
     25.1,
     {{{"TOA", {20.7, 22.8, 18.2}}, {"Fast-TOA", {22.2, 20.0, 20.0}}, {"GlobalMatch", {6.5, 3.5, 6.0}}}}},
}};

/// The plot of [GM] that a name is that of, as Plot #1, plot_1, Tongji-Trees Plot 1, WHU-FGI or ETH_Trees;
/// null where it is none.
inline const paper_plot* find_paper_plot(std::string_view name) {
  const auto letters = [](std::string_view text) {
    std::string kept;
    for (const char c : text)
      if (std::isalnum(static_cast<unsigned char>(c)))
        kept += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    for (const std::string_view prefix : {"tongjitrees", "tongji"})
      if (kept.starts_with(prefix)) kept.erase(0, prefix.size());
    return kept;
  };
  for (const paper_plot& plot : paper_plots)
    if (letters(plot.name) == letters(name)) return &plot;
  return nullptr;
}

}  // namespace globalmatch::benchmarks

// Is a transform right when it is said to be? Pairs of maps of one stand, of different stands, and of stands
// on a lattice: outcomes, and how probable right ones were said to be.
#include <globalmatch/stem_matching.hpp>

#include "calibration.hpp"
#include "stem_layouts.hpp"
#include "support/atomic_file.hpp"
#include "support/programs/command_line.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <iomanip>
#include <iostream>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::detail;
using namespace globalmatch::benchmarks;

namespace {

/// Two maps, and what is known of them.
struct trial {
  std::string layout;
  double noise = 0, overlap = 0;
  two_maps maps;
  double spacing = 0;  ///< [m] of a square lattice whose places are its multiples, in the source's frame
};

/// What does not depend on the suite.
struct further_view {
  std::optional<double> radius_noise = {};  ///< [m] of radii, where maps carry them
  bool horizontal = false;                  ///< heights are ignored
} further;

using generator = std::function<trial(random_source&)>;

/// As many in each octave.
std::size_t any_size(double minimum, double maximum, random_source& random) {
  return std::size_t(std::round(minimum * std::pow(maximum / minimum, random.uniform())));
}

/// Hills of some 60 to 190 m, anywhere.
relief any_ground(random_source& random) {
  return {uniform(random, 10, 30), uniform(random, 10, 30), uniform(random, -3, 3), uniform(random, -3, 3)};
}

/// Maps of different stands of one kind, on different ground.
trial different_stands(random_source& random) {
  trial t;
  t.layout = any_of<std::string>({"random", "rows", "clumped"}, random);
  t.noise = any_of<double>({0.02, 0.10}, random);
  const double jitter = uniform(random, 0.10, 0.15);
  const std::size_t stems = any_size(20, 500, random);
  const view_options noisy{.noise = t.noise, .radius_noise = further.radius_noise};
  const auto view = [&] {
    return overlapping_maps(t.layout, stems, 1, noisy, random,
                            {.jitter = jitter, .ground = any_ground(random)});
  };
  t.maps = view();
  two_maps other = view();
  t.maps.target = std::move(other.target);
  t.maps.target_radii = std::move(other.target_radii);
  t.maps.common = 0;
  return t;
}

/// Maps that share 5 to 100 % of their area, of the given layouts and noise.
generator one_stand(std::vector<std::string> layouts, std::vector<double> noises, double min_overlap,
                    double max_overlap, double min_detected, double max_false) {
  return [=](random_source& random) {
    trial t;
    t.layout = any_of(layouts, random);
    t.noise = any_of(noises, random);
    t.overlap = uniform(random, min_overlap, max_overlap);
    const view_options view{.noise = t.noise,
                            .detected = uniform(random, min_detected, 1),
                            .false_stems = uniform(random, 0, max_false),
                            .radius_noise = further.radius_noise};
    const stand_options background_density{.jitter = uniform(random, 0.10, 0.15)};
    t.maps =
        overlapping_maps(t.layout, any_size(20, 500, random), t.overlap, view, random, background_density);
    return t;
  };
}

/// Perfect lattices of 10 to 20 rows and columns, wholly seen by both scans; `missing` of their trees are.
generator planted_lattice(double missing, std::size_t min_gaps) {
  return [=](random_source& random) {
    trial t{.layout = missing > 0 ? "lattice with gaps" : "perfect lattice",
            .noise = 0.02,
            .overlap = 1,
            .maps = {},
            .spacing = 0};
    std::size_t gaps = 0;
    do {
      const double spacing = t.spacing = uniform(random, 2, 4);
      const auto columns = 10 + random.below(11), rows = 10 + random.below(11);
      positions stems;
      gaps = 0;
      for (std::uint32_t c = 0; c < columns; ++c)
        for (std::uint32_t r = 0; r < rows; ++r) {
          if (random.uniform() < missing)
            ++gaps;
          else
            stems.push_back({c * spacing, r * spacing, 0});
        }
      const double all = columns * spacing;
      t.maps = look_twice(
          stems, all, all,
          {.noise = t.noise, .detected = 0.98, .false_stems = 0, .radius_noise = further.radius_noise},
          any_yaw_elsewhere(random), random);
    } while (gaps < min_gaps);
    return t;
  };
}

struct suite {
  std::string_view name;
  std::size_t pairs;
  generator next;
};

/// What became of a trial.
struct result {
  trial of;
  matching match;
  bool best_right = false;

  bool is(outcome o) const { return match.outcome == o; }
  bool wrong() const { return match.target_from_source && !best_right; }
};

result run(trial&& t) {
  result r{std::move(t), {}};
  const two_maps& maps = r.of.maps;
  matching_options options;
  options.horizontal = further.horizontal;
  r.match = further.radius_noise ? match_stems(with_radii(maps.source, maps.source_radii),
                                               with_radii(maps.target, maps.target_radii), options)
                                 : match_stems(maps.source, maps.target, options);
  r.best_right = r.of.maps.common > 0 && !r.match.hypotheses.empty() &&
                 mean_error(r.match.hypotheses.front().target_from_source, r.of.maps.target_from_source,
                            r.of.maps.source) < std::max(0.3, 3 * r.of.noise);
  return r;
}

/// Whether a transform differs from the true one by a symmetry of the lattice: it maps places of the lattice
/// to places.
bool is_of_the_lattice(const trial& t, const Eigen::Isometry3d& target_from_source) {
  const Eigen::Isometry3d own = t.maps.target_from_source.inverse() * target_from_source;
  const auto nearest_place = [&](const Eigen::Vector3d& p) {
    return Eigen::Vector2d(t.spacing * (p.head<2>() / t.spacing).array().round().matrix());
  };
  const double near = std::max(0.1, 3 * t.noise);
  return std::all_of(t.maps.source.begin(), t.maps.source.end(), [&](const Eigen::Vector3d& p) {
    Eigen::Vector3d place(0, 0, p.z());
    place.head<2>() = nearest_place(p);
    const Eigen::Vector3d transformed = own * place;
    return (transformed.head<2>() - nearest_place(transformed)).norm() < near;
  });
}

/// Whether the lattice that was reported is that of the trial: square, of its spacing.
bool reports_the_lattice(const result& r) {
  constexpr double near = 0.05;  // [m]
  const auto& lattice = r.match.lattice;
  return lattice && std::abs(lattice->first.norm() - r.of.spacing) < near &&
         std::abs(lattice->second.norm() - r.of.spacing) < near &&
         std::abs(lattice->angle() - std::numbers::pi / 2) < near / r.of.spacing;
}

/// Alternative hypotheses of stands on a lattice: are they its shifts times its symmetries?
void print_alternatives(const std::vector<result>& results) {
  std::size_t hypotheses = 0, of_the_lattice = 0, with_alternatives = 0, reported = 0;
  for (const result& r : results) {
    for (const hypothesis& h : r.match.hypotheses) {
      ++hypotheses;
      of_the_lattice += is_of_the_lattice(r.of, h.target_from_source);
    }
    with_alternatives += r.match.hypotheses.size() > 1;
    reported += reports_the_lattice(r);
  }
  std::cout << "\nhypotheses " << hypotheses << ", of these shifts times symmetries of the lattice "
            << of_the_lattice << "; pairs with alternatives " << with_alternatives
            << ", with the lattice reported " << reported << ", of " << results.size() << "\n\n";
}

void print(std::string_view title, const std::vector<result>& results,
           const std::function<bool(const result&)>& chosen) {
  std::size_t pairs = 0, best = 0, right = 0, wrong = 0, ambiguous = 0;
  for (const result& r : results) {
    if (!chosen(r)) continue;
    ++pairs;
    best += r.best_right;
    right += r.is(outcome::registered) && r.best_right;
    wrong += r.wrong();
    ambiguous += r.is(outcome::ambiguous);
  }
  std::cout << "| " << title << " | " << pairs << " | " << best << " | " << right << " | " << wrong << " | "
            << ambiguous << " | " << pairs - right - wrong - ambiguous << " |\n"
            << std::flush;
}

void write_line(std::ostream& csv, std::string_view suite, const result& r) {
  const auto& h = r.match.hypotheses;
  const double none = 99;
  csv << suite << ',' << r.of.layout << ',' << r.of.noise << ',' << r.of.overlap << ','
      << r.of.maps.source.size() << ',' << r.of.maps.target.size() << ',' << r.of.maps.common << ','
      << to_string(r.match.outcome) << ',' << r.best_right << ',' << r.match.inlier_threshold << ','
      << r.match.funnel.correspondences << ',' << (h.empty() ? none : h[0].log10_nfa) << ','
      << (h.empty() ? none : h[0].log10_nfa_poisson) << ',' << (h.size() < 2 ? none : h[1].log10_nfa) << ','
      << (h.size() < 2 ? 0 : h[1].correspondences.size()) << ',' << r.match.probability << ','
      << (h.empty() ? "" : to_string(h[0].evidence)) << '\n';
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Outcomes of matching where the truth is known: different stands, one stand, lattices.",
               "decision_rates");
  std::vector<std::string> chosen;
  std::size_t pairs = 0;
  std::uint64_t seed = 1;
  std::filesystem::path csv_file = "decision_rates.csv";
  app.add_option("--suites", chosen, "different, one, lattice, gaps, calibration; all if not given")
      ->delimiter(',');
  app.add_option("--pairs", pairs, "of each suite; 0: 1000, of lattices 100, of calibration 2000")
      ->capture_default_str();
  app.add_option("--seed", seed, "of all that is random")->capture_default_str();
  app.add_option("--radii", further.radius_noise,
                 "[m] noise of stem radii, which differ by 2 cm; no radii if not given");
  app.add_flag("--horizontal", further.horizontal, "ignore heights");
  app.add_option("--csv", csv_file, "file with a line for each pair")->capture_default_str();

  return support::run_program(app, argc, argv, [&] {
    const std::vector<suite> suites = {
        {"different", 1000, different_stands},
        {"one", 1000, one_stand({"random", "rows", "clumped"}, {0.02, 0.10}, 0.05, 1, 0.85, 0.1)},
        {"lattice", 100, planted_lattice(0, 0)},
        {"gaps", 100, planted_lattice(0.1, 15)},
        {"calibration", 2000,
         one_stand({"spaced", "gradient", "staggered"}, {0.01, 0.05, 0.15}, 0.0, 0.6, 0.6, 0.4)},
    };
    support::atomic_file csv(csv_file);
    csv.stream()
        << "suite,layout,noise,overlap,source,target,common,outcome,best_right,inlier_threshold,pairs,"
           "log10_nfa,log10_nfa_poisson,alternative_log10_nfa,alternative_pairs,probability,evidence\n";
    std::cout << "| pairs of maps | pairs | best right | registered, right | registered, wrong | ambiguous | "
                 "not registered |\n"
                 "|---|---|---|---|---|---|---|\n";
    for (const suite& s : suites) {
      if (!chosen.empty() && std::find(chosen.begin(), chosen.end(), s.name) == chosen.end()) continue;
      random_source random(seed);
      std::vector<result> results;
      for (std::size_t i = 0; i < (pairs > 0 ? pairs : s.pairs); ++i) {
        results.push_back(run(s.next(random)));
        write_line(csv.stream(), s.name, results.back());
      }
      print(s.name, results, [](const result&) { return true; });
      if (s.name == "calibration") {
        std::vector<prediction> said;
        for (const result& r : results) said.push_back({r.match.probability, r.best_right});
        print_calibration(std::move(said));
      }
      if (s.name == "lattice") print_alternatives(results);
      if (s.name == "one") {
        const auto enough = [](const result& r) { return r.of.maps.common >= 12; };
        print("of these 12 common stems or more", results, enough);
        for (const char* layout : {"random", "clumped", "rows"})
          for (const double noise : {0.02, 0.10})
            print(std::string("of these ") + layout + ", " + (noise < 0.05 ? "2 cm" : "10 cm"), results,
                  [&](const result& r) { return enough(r) && r.of.layout == layout && r.of.noise == noise; });
      }
    }
    csv.commit();
    return support::done;
  });
}

// How often is it named what is wrong with a stem map, and are maps without a fault ever blamed? Windows of
// real maps, spoilt, written to files, and read and matched as the program match_stems does.
#include "diagnoses.hpp"
#include "map_faults.hpp"
#include "map_windows.hpp"
#include "support/atomic_file.hpp"
#include "support/programs/command_line.hpp"
#include "support/programs/reports.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::benchmarks;
using std::filesystem::path;

namespace {

struct tally {
  std::size_t pairs = 0, named = 0, wrong = 0, right = 0;
  friend std::ostream& operator<<(std::ostream& out, const tally& t) {
    return t.pairs == 0 ? out << "|" : out << t.named << ", " << t.wrong << ", " << t.right << " |";
  }
};

/// Writes and matches maps, with a line for each pair.
class pair_table {
 public:
  explicit pair_table(const path& folder)
      : source_(folder / "source.csv"), target_(folder / "target.csv"), csv_(folder / "pairs.csv") {
    csv_.stream() << "pair,source,target,common,outcome,log10_nfa,factor,sigma,named,wrong,right,said\n";
  }
  void commit() { csv_.commit(); }

  /// Spoils a pair, or not, writes, reads and matches it.
  void add(const std::string& name, window_pair pair, const fault* f, random_source& random, tally& sum) {
    positions &source = pair.maps.source, &target = pair.maps.target, ends;
    for (const Eigen::Vector3d& p : source) ends.push_back(pair.maps.target_from_source * p);
    const bool of_target = sum.pairs % 2 == 1, both = f && f->place == place_of_fault::both_maps,
               one = f && f->place == place_of_fault::one_map;
    const bool first = both || (one && !of_target), second = both || (one && of_target);
    if (first) f->spoil(source, random);
    if (second) f->spoil(target, random), f->spoil(ends, random);
    write_map(source_, source, first ? f->columns : "x,y,z");
    write_map(target_, target, second ? f->columns : "x,y,z");

    const diagnosis d = diagnose(source_, target_, false);
    const bool named = f && f->is_named(d, one && of_target ? "target" : "source");
    const bool wrong =
        std::any_of(d.said.begin(), d.said.end(), [&](const auto& w) { return !named || w.code != f->code; });
    const matching applied = f && f->code == "scale" ? diagnose(source_, target_, true).result : d.result;
    const bool right = is_right_in_plan(applied, source, ends);
    ++sum.pairs, sum.named += named, sum.wrong += wrong, sum.right += right;
    const hypothesis best = d.result.hypotheses.empty() ? hypothesis{} : d.result.hypotheses.front();
    const scale_estimate scale = d.result.scale.value_or(scale_estimate{});
    csv_.stream() << '"' << name << "\"," << source.size() << ',' << target.size() << ',' << pair.common
                  << ',' << to_string(d.result.outcome) << ',' << best.log10_nfa << ',' << scale.factor << ','
                  << scale.sigma << ',' << named << ',' << wrong << ',' << right << ",\"";
    for (const support::warning& w : d.said) csv_.stream() << w.code << ": " << w.text << "; ";
    csv_.stream() << "\"\n";
  }

 private:
  path source_, target_;
  support::atomic_file csv_;
};

/// Of windows that share half of their area or more.
tally spoil_windows(const map_group& group, const fault& f, std::size_t pairs, random_source random,
                    pair_table& table) {
  tally sum;
  for (std::size_t i = 0; i < pairs; ++i) {
    positions forest = any_of(group.maps, random);
    if (f.place == place_of_fault::forest) f.spoil(forest, random);
    const auto trees = std::size_t(uniform(random, double(f.min_trees), double(f.max_trees)));
    window_pair pair = cut_pair(forest, trees, {.noise = 0.03}, random, {0, 0.8});
    table.add(std::string(f.name) + " in " + group.name, std::move(pair), &f, random, sum);
  }
  return sum;
}

/// Of windows with little to nearly all in common, or with nothing.
tally leave_windows(const std::vector<map_group>& groups, bool related, std::size_t pairs,
                    random_source random, pair_table& table) {
  tally sum;
  for (std::size_t i = 0; i < pairs; ++i) {
    const std::vector<positions>& maps = groups[i % groups.size()].maps;
    window_pair pair;
    if (related) {
      const double noise = any_of<double>({0.02, 0.05, 0.1}, random), trees = uniform(random, 40, 120);
      pair = cut_pair(any_of(maps, random), std::size_t(trees), {.noise = noise}, random, {0, 1.8});
    } else {
      unrelated other = window_source(maps, 120).pair(random);
      pair.maps.source = std::move(other.source), pair.maps.target = std::move(other.target);
      pair.maps.target_from_source = Eigen::Translation3d(1e6, 0, 0);  // nothing is right
    }
    table.add(related ? "healthy, related" : "healthy, unrelated", std::move(pair), nullptr, random, sum);
  }
  return sum;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Names of faults of stem maps, and of maps without one.", "diagnosis_rates");
  std::vector<path> files;
  std::vector<std::string> chosen;
  std::size_t seeds = 20, healthy = 200;
  std::uint64_t seed = 1;
  path folder = "diagnosis_rates";
  app.add_option("MAP", files, "stem maps (CSV) that windows are cut from")->required();
  app.add_option("--faults", chosen, "that maps have; all if not given")->delimiter(',');
  app.add_option("--seeds", seeds, "pairs of each fault and map")->capture_default_str();
  app.add_option("--healthy", healthy, "pairs without a fault, related and unrelated")->capture_default_str();
  app.add_option("--seed", seed, "of all that is random")->capture_default_str();
  app.add_option("--folder", folder, "of the maps, and of a line for each pair")->capture_default_str();

  return support::run_program(app, argc, argv, [&] {
    std::filesystem::create_directories(folder);
    const std::vector<map_group> groups = read_groups(files);
    pair_table table(folder);
    std::cout << "| named, blamed wrongly, registered rightly, of " << seeds << " |";
    for (const map_group& g : groups) std::cout << ' ' << g.name << " |";
    std::cout << "\n|---|";
    for (std::size_t i = 0; i < groups.size(); ++i) std::cout << "---|";
    for (const fault& f : usual_faults()) {
      if (!chosen.empty() && std::find(chosen.begin(), chosen.end(), f.name) == chosen.end()) continue;
      std::cout << "\n| " << f.name << " |";
      for (const map_group& g : groups)
        std::cout << ' '
                  << spoil_windows(g, f, g.max_trees() < f.min_trees ? 0 : seeds, random_source(seed), table);
    }
    for (const bool related : {true, false}) {
      const tally sum = leave_windows(groups, related, healthy, random_source(seed), table);
      std::cout << (related ? "\n\n" : "\n") << sum.pairs << (related ? " related" : " unrelated")
                << " healthy pairs: blamed " << sum.wrong << ", registered rightly " << sum.right;
    }
    std::cout << "\n";
    table.commit();
    return support::done;
  });
}

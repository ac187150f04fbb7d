#include "support/programs/command_line.hpp"

#include <globalmatch/registration.hpp>

#include "support/build_record.hpp"
#include "support/transform_files.hpp"

#include <exception>
#include <iostream>
#include <new>
#include <numbers>

namespace globalmatch::support {

void shared_options::add_mapping_to(CLI::App& app) {
  app.add_option("--up", up, "direction away from the ground, in the frame of the scans")
      ->delimiter(',')
      ->expected(3)
      ->type_name("X,Y,Z")
      ->capture_default_str();
  app.add_option(
         "--vertical", vertical,
         "given: as --up says; stems: mean axis of the stems; auto: that if the stems are clearly tilted")
      ->check(CLI::IsMember({"given", "stems", "auto"}))
      ->capture_default_str();
  app.add_option("--scanner", scanner,
                 "where the scanner stood, in the frame of the scan, its origin if not given: no stem stands "
                 "where it saw further; scan_info measures densities around it")
      ->delimiter(',')
      ->expected(3)
      ->type_name("X,Y,Z");
  app.add_option("--seed", seed, "seed of the random numbers")->capture_default_str();
  app.add_option("--min-quality", min_quality, "what is less likely to be a stem is left out; 0 keeps all")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_flag("--no-verticality", no_verticality, "look for stems among all understory points");
  app.add_flag("--keep-noise", keep_noise, "read LAS points that are marked as noise or withheld, too");
  app.add_flag("--tiles", tiles, "a folder is one scan, whose files are tiles in one frame");
  app.add_option("--memory", memory,
                 "points of a compressed scan are kept in memory if they take no more than this; others are "
                 "decoded whenever they are needed")
      ->check(CLI::Range(0.0, 1e6))
      ->type_name("GB")
      ->capture_default_str();
  app.add_flag("--normalized", normalized, "heights are above the ground already, which may be missing");
}

void shared_options::add_matching_to(CLI::App& app) {
  app.add_option(
         "--dof", dof,
         "4: rotate about the vertical only; 6: rotate freely; auto: freely where a scan is rotated beyond "
         "doubt")
      ->check(CLI::IsMember({"auto", "4", "6"}))
      ->capture_default_str();
  app.add_option("--tolerance", tolerance,
                 "inlier threshold [m]: corresponding stems are closer; estimated if not given")
      ->check(CLI::PositiveNumber)
      ->type_name("M");
  app.add_flag("--horizontal", horizontal, "ignore the heights of the stems");
  app.add_option(
         "--comparisons", comparisons,
         "pairs of maps that are compared, of which most have nothing in common: each needs more evidence")
      ->check(CLI::Range(1.0, 1e12))
      ->capture_default_str();
  app.add_flag("--require-height", require_height,
               "a transform whose height is not known counts as none (exit status 1)");
}

void shared_options::add_prior_to(CLI::App& app) {
  auto* known =
      app.add_option("--prior", prior,
                     "4 x 4 matrix, source to target, that is known beforehand; others are not searched "
                     "unless the stems contradict it beyond doubt");
  known->type_name("FILE");
  app.add_option("--prior-sigma", prior_sigma,
                 "standard deviations of the prior: in plan, along each axis, at the centroid of the source "
                 "stems, and of the turn [degrees]")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::NonNegativeNumber)
      ->needs(known)
      ->type_name("M,DEG")
      ->capture_default_str();
}

void shared_options::add_icp_to(CLI::App& app) {
  app.add_option("--icp", icp, "fine registration: none, point (to point) or plane (point to plane)")
      ->check(CLI::IsMember({"none", "point", "plane"}))
      ->capture_default_str();
}

void shared_options::add_threads_to(CLI::App& app) {
  app.add_option("--threads", threads, "number of threads; 0: all")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
}

void shared_options::add_forms_to(CLI::App& app, bool of_scans) {
  app.add_option("--out-as", out_as,
                 std::string("the transform in the form of the name, which may be given again: .mat.txt or "
                             ".cc.txt (CloudCompare), .dat (RiSCAN PRO), .json (pipeline for PDAL)") +
                     (of_scans ? ", .e57 or .ptx (copy of such a scan with its pose)" : "") +
                     "; what applies it is printed")
      ->type_name("FILE")
      ->allow_extra_args(false);
}

void shared_options::add_execution_to(CLI::App& app) {
  add_threads_to(app);
  app.add_option("--json", json, "write counts, times and the result to this file")->type_name("FILE");
}

scan_options shared_options::for_reading() const {
  return {.keep_marked = keep_noise,
          .tiles = tiles,
          .threads = threads,
          .memory = static_cast<std::uint64_t>(memory * double(std::uint64_t(1) << 30))};
}

mapping_options shared_options::for_mapping() const {
  mapping_options options;
  options.verticality.constraint = !no_verticality;
  if (normalized) options.ground.filter = ground_filter::normalized;
  options.vertical = vertical == "given"   ? vertical_rule::given
                     : vertical == "stems" ? vertical_rule::stems
                                           : vertical_rule::stems_if_tilted;
  options.stems.cylinder.seed = seed;
  options.min_quality = min_quality;
  if (!scanner.empty()) options.scanner = {scanner[0], scanner[1], scanner[2]};
  return options;
}

matching_options shared_options::for_matching() const {
  matching_options options;
  if (dof != "auto") options.dof = dof == "6" ? degrees_of_freedom::six : degrees_of_freedom::four;
  options.inlier_threshold = tolerance;
  options.horizontal = horizontal;
  options.scale = scale;
  options.decision.comparisons = comparisons;
  if (!prior.empty())
    options.prior = {read_transform(prior), prior_sigma[0], prior_sigma[1] * std::numbers::pi / 180};
  return options;
}

icp_options shared_options::for_icp() const {
  icp_options options;
  options.metric = icp == "none"    ? icp_metric::none
                   : icp == "point" ? icp_metric::point_to_point
                                    : icp_metric::point_to_plane;
  return options;
}

int run_program(CLI::App& app, int argc, char** argv, const std::function<int()>& body) {
  const auto fail = [&](const std::string& message) {
    std::cerr << app.get_name() << ": " << message << '\n';
    return unusable_input;
  };
  app.set_version_flag("--version", app.get_name() + " of globalmatch " + this_build().name(),
                       "version, commit and compiler of this build, and exit");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? done : unusable_input;
  }
  try {
    return body();
  } catch (const std::bad_alloc&) {
    return fail("not enough memory for this input; thin it or split it");
  } catch (const std::exception& e) {
    return fail(e.what());
  }
}

}  // namespace globalmatch::support

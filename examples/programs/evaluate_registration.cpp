// Compares a registration with the truth.
#include <globalmatch/evaluation.hpp>

#include "support/programs/command_line.hpp"
#include "support/scan_files.hpp"
#include "support/transform_files.hpp"

#include <iomanip>
#include <iostream>
#include <numbers>

using namespace globalmatch;

int main(int argc, char** argv) {
  CLI::App app("Errors of a registration: e_R, e_t, and e_p over the points of the source scan.",
               "evaluate_registration");
  std::filesystem::path estimate_file, truth_file, source_pose, target_pose, scan_file;
  app.add_option("T", estimate_file, "4 x 4 matrix, source to target")->required();
  app.add_option("--scan", scan_file, "the source scan")->required();
  auto* truth_option = app.add_option("--truth", truth_file, "the true 4 x 4 matrix, source to target");
  auto* source_option =
      app.add_option("--source-pose", source_pose, "true pose of the source scan in the plot");
  auto* target_option =
      app.add_option("--target-pose", target_pose, "true pose of the target scan in the plot");
  source_option->needs(target_option)->excludes(truth_option);
  target_option->needs(source_option);

  return support::run_program(app, argc, argv, [&] {
    if (truth_file.empty() && source_pose.empty())
      throw std::invalid_argument("give --truth, or --source-pose and --target-pose");
    const Eigen::Isometry3d estimate = support::read_transform(estimate_file);
    const Eigen::Isometry3d truth = truth_file.empty() ? support::read_transform(target_pose).inverse() *
                                                             support::read_transform(source_pose)
                                                       : support::read_transform(truth_file);
    const auto scan = support::open_scan(scan_file);
    if (scan.empty())
      throw std::invalid_argument(scan_file.string() + ": holds no points to measure e_p with");
    const registration_error error = evaluate_registration(estimate, truth, scan);
    std::cout << std::fixed << std::setprecision(2)  //
              << "e_p " << 100 * error.pointwise << " cm (horizontal " << 100 * error.horizontal
              << ", vertical " << 100 * error.vertical << ")\n"
              << "e_R " << 1000 * error.rotation << " mrad, e_t " << 100 * error.translation << " cm\n";
    return error.success() ? support::done : support::no_registration;
  });
}

// Quick start: two scans in, one motion out.
#include <globalmatch/registration.hpp>

#include "support/scan_files.hpp"

#include <iostream>

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: 01_quick_start SOURCE TARGET\n";
    return 2;
  }
  const auto source = globalmatch::support::read_scan(argv[1]);
  const auto target = globalmatch::support::read_scan(argv[2]);

  const auto result = globalmatch::register_scans(source, target).registration;
  if (!result.target_from_source) {
    std::cerr << to_string(result.outcome) << ": " << result.reason << '\n';
    return 1;
  }
  std::cout << result.target_from_source->matrix() << '\n';
  return 0;
}

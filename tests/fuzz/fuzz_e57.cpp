// E57 files of any content whose checksums fit: scans, or a `file_error`.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "fuzz_input.hpp"
#include "support/e57.hpp"
#include "support/e57_checksums.hpp"
#include "support/file_error.hpp"
#include "support/temporary_directory.hpp"

using namespace globalmatch;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const support::temporary_directory folder;
  const std::filesystem::path file = folder / "input.e57";
  std::string pages(reinterpret_cast<const char*>(data), size);
  support::seal_pages(pages);
  std::ofstream(file, std::ios::binary) << pages;
  try {
    support::input_file input(file);
    const std::size_t scans = std::min<std::size_t>(support::count_e57_scans(input), 4);
    for (std::size_t number = 1; number <= scans; ++number) {
      const support::opened_scan scan = support::open_e57(input, number, {});
      fuzz::require(scan.points->size() <= size, "each point takes a byte or more");
      std::vector<Eigen::Vector3d> all(scan.points->size()), one(1);
      scan.points->read(0, all);
      for (std::size_t i = 0; i < std::min<std::size_t>(all.size(), 20); ++i) {
        scan.points->read(i, one);
        fuzz::require((one[0].array() == all[i].array() || all[i].array().isNaN()).all(),
                      "a point is the same alone and among others");
      }
    }
  } catch (const support::file_error&) {
    // which names the file, what is wrong and what would help
  }
  return 0;
}

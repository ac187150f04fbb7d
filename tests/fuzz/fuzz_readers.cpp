// Files of any content: points, a table, a transform, or a `file_error`.
#include <filesystem>
#include <fstream>
#include <numeric>
#include <string>

#include "fuzz_input.hpp"
#include "support/class_counts.hpp"
#include "support/file_error.hpp"
#include "support/scan_files.hpp"
#include "support/scan_writer.hpp"
#include "support/stem_files.hpp"
#include "support/temporary_directory.hpp"
#include "support/transform_files.hpp"

using namespace globalmatch;

namespace {

bool is_same(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return (a.array().isNaN() == b.array().isNaN()).all() &&
         (a.array().isNaN() || a.array() == b.array()).all();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const support::temporary_directory folder;
  const std::filesystem::path file = folder / "input";
  fuzz::byte_source bytes(data, size);
  const unsigned reader = bytes.choice(3);
  {
    std::ofstream out(file, std::ios::binary);
    if (size > 1) out.write(reinterpret_cast<const char*>(data) + 1, std::streamsize(size - 1));
  }
  try {
    if (reader == 0) {
      const support::scan_file scan = support::open_scan(file, {.attributes = true});
      fuzz::require(scan.size() <= size, "each point takes a byte or more");
      const auto first = scan.begin();
      std::ptrdiff_t i = 0;
      for (const Eigen::Vector3d& p : scan) {
        const bool is_looked_at = i < 100;  // a point alone is dear where files are compressed
        fuzz::require(!is_looked_at || is_same(first[i], p), "a point is the same alone and among others");
        ++i;
      }
      if (const auto counts = scan.points().count_classes({.threads = 1})) {
        const auto sum = std::accumulate(counts->classes.begin(), counts->classes.end(), std::size_t(0));
        fuzz::require(sum <= scan.size(), "a point has one class");
      }
      const support::placed_scan placed{&scan, Eigen::Isometry3d::Identity(), {}};
      support::write_scans(folder / (size % 2 ? "output.las" : "output.laz"), {&placed, 1}, 1);
    } else if (reader == 1) {
      for (const support::stem_record& s : support::read_stems(file).stems)
        fuzz::require(std::isfinite(s.x + s.y + s.z), "positions that were read are finite");
    } else {
      const Eigen::Isometry3d transform = support::read_transform(file);
      fuzz::require(std::abs(transform.linear().determinant() - 1) < 1e-3,
                    "a transform that was read is rigid");
    }
  } catch (const support::file_error&) {
    // which names the file, what is wrong and what would help
  }
  return 0;
}

#include <filesystem>
#include <string>
#include <vector>

#include "catch.hpp"
#include "e57_writer.hpp"
#include "las_checks.hpp"
#include "support/scan_sets.hpp"
#include "support/scan_writer.hpp"
#include "written_scans.hpp"

namespace globalmatch::support::test_e57_attributes {

TEST_CASE("an E57 scan gives its attributes, in the units of LAS where that has them") {
  const temporary_directory directory;
  const written_scan e57{{double_field("cartesianX", {1, 2}), double_field("cartesianY", {3, 4}),
                          double_field("cartesianZ", {5, 6}), float_field("intensity", {0.5f, 0.25f}),
                          integer_field("colorRed", 0, 255, {7, 255}),
                          integer_field("returnIndex", 0, 3, {0, 2}),
                          integer_field("rowIndex", -5, 70'000, {-5, 70'000})}};
  const auto path = directory.file("a.e57", e57_file({e57}));
  write_scan(directory / "out.las", open_scan(path, {.keep_marked = true, .attributes = true}));
  const scan_file written = open_scan(directory / "out.las");
  CHECK(values_of(written, "intensity") == std::vector<double>{32768, 16384});
  CHECK(values_of(written, "red") == std::vector<double>{7 * 257, 65535});
  CHECK(values_of(written, "return_number") == std::vector<double>{1, 3});
  CHECK(values_of(written, "rowIndex") == std::vector<double>{-5, 70'000});
}

}  // namespace globalmatch::support::test_e57_attributes

#include "support/scans_on_demand.hpp"

#include <vector>

#include "catch.hpp"
#include "support/file_error.hpp"
#include "written_scans.hpp"

namespace globalmatch::support::test_scans_on_demand {

TEST_CASE("scans of which one at a time is open have the points and attributes of open ones") {
  const temporary_directory directory;
  const auto a = directory.file("a.las", made_las_bytes(3, 2, 5000)),
             b = directory.file("b.las", made_las_bytes(7, 0, 9000));
  const auto opener = std::make_shared<scan_opener>(scan_options{.keep_marked = true, .attributes = true});
  const scan_file first = open_on_demand(a, opener), second = open_on_demand(b, opener);
  for (int pass = 0; pass < 2; ++pass)
    for (const auto& [path, scan] : {std::pair(a, &first), std::pair(b, &second)}) {
      const scan_file open = open_scan(path, {.keep_marked = true, .attributes = true});
      REQUIRE(scan->size() == open.size());
      CHECK(std::vector(scan->begin(), scan->end()) == std::vector(open.begin(), open.end()));
      CHECK(scan->header().format == open.header().format);
      for (const attribute& of : open.points().attributes())
        CHECK(numbers_of(*scan, of.name) == numbers_of(open, of.name));
    }
}

TEST_CASE("a scan that has changed or gone since it was named is said to be") {
  const temporary_directory directory;
  const auto a = directory.file("a.las", made_las_bytes(3, 0, 500)),
             b = directory.file("b.las", made_las_bytes(3, 0, 500));
  const auto opener = std::make_shared<scan_opener>(scan_options{});
  const scan_file first = open_on_demand(a, opener), second = open_on_demand(b, opener);
  directory.file("a.las", made_las_bytes(3, 0, 400));
  std::vector<Eigen::Vector3d> points(10);
  CHECK_THROWS_WITH(first.points().read(0, points), Catch::Contains("has changed"));
  second.points().read(0, points);
  std::filesystem::remove(a);
  CHECK_THROWS_AS(first.points().read(0, points), file_error);
  CHECK_THROWS_AS(open_on_demand(directory / "absent.las", opener), file_error);
}

}  // namespace globalmatch::support::test_scans_on_demand

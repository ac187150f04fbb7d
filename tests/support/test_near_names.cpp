#include "support/programs/near_names.hpp"

#include <string>
#include <vector>

#include "catch.hpp"

namespace globalmatch::support::test_near_names {

TEST_CASE("the distance of two texts counts letters to insert, remove or replace") {
  CHECK(edit_distance("", "") == 0);
  CHECK(edit_distance("scan", "") == 4);
  CHECK(edit_distance("kitten", "sitting") == 3);
  CHECK(edit_distance("sitting", "kitten") == 3);
  CHECK(edit_distance("scan_1", "scan_12") == 1);
}

TEST_CASE("a name that is near is suggested, whatever its case and extension, else those that there are") {
  const std::vector<std::string> names = {"north", "plot_1", "plot_2", "plot_3", "plot_4", "plot_5", "west"};
  CHECK(suggest_name("plot2", names) == "is it plot_2?");
  CHECK(suggest_name("NORTH", names) == "is it north?");
  CHECK(suggest_name("west.laz", names) == "is it west?");
  CHECK(suggest_name("east", {"north", "plot"}) == "there are north, plot");
  CHECK(suggest_name("quarry", names) == "there are north, plot_1, plot_2, plot_3, plot_4 and 2 others");
  CHECK(suggest_name("any", {}) == "there are none");
}

}  // namespace globalmatch::support::test_near_names

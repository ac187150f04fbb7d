// What a user should know of a scan, its map and a result: for people and, by their codes, for programs.
#pragma once

#include <string>
#include <vector>

namespace globalmatch {
struct stem_map;
struct matching;
}  // namespace globalmatch

namespace globalmatch::support {

struct warning {
  std::string code, text;
};

/// Of points left out, ground that was not seen, noise, heights above the ground, and no stems.
std::vector<warning> warnings_of(const stem_map& map);

/// Of a height that is not known, and of heights that slope.
std::vector<warning> warnings_of(const globalmatch::matching& result);

}  // namespace globalmatch::support

// Files of matches, and the links of a map in them: what is read is written again with the same bytes, or
// refused.
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "fuzz_input.hpp"
#include "globalmatch/detail/survey/map_links.hpp"
#include "globalmatch/survey_matches.hpp"

using namespace globalmatch;

namespace {

void check_file(const std::string& bytes) {
  std::istringstream in(bytes);
  try {
    const survey_matches read = read_survey_matches(in);
    std::ostringstream out;
    write_survey_matches(out, read);
    fuzz::require(bytes.starts_with(out.str()), "what was read is written with the same bytes");
  } catch (const std::runtime_error&) {
    return;
  }
}

/// Of the first of three maps, of four stems each.
void check_links(const std::string& bytes) {
  static const std::vector<detail::prepared_stems> maps = [] {
    std::vector<detail::prepared_stems> made(3);
    for (detail::prepared_stems& map : made) map.stems.at.resize(4);
    return made;
  }();
  try {
    const detail::map_links found = detail::map_links_of(0, bytes, maps);
    for (const detail::survey_link& l : found.links) {
      fuzz::require(l.source == 0 && (l.target == 1 || l.target == 2),
                    "links are those of the map to others");
      for (const correspondence& c : l.correspondences)
        fuzz::require(c.source < 4 && c.target < 4, "links pair stems that there are");
    }
    fuzz::require(detail::bytes_of(found) == bytes, "links are the same bytes again");
  } catch (const std::invalid_argument&) {
    return;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  check_file(bytes);
  check_links(bytes);
  return 0;
}

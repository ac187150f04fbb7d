// Shares of the matching of a survey, which several processes or machines work on, and their files.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <istream>
#include <ostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/byte_archives.hpp"
#include "globalmatch/detail/core/checked_sections.hpp"

namespace globalmatch {

/// What some maps of a survey have in common with others: `match_survey` makes it, `solve_survey` takes it.
/// Its contents are those of the library.
struct survey_matches {
  /// Every `count`-th map, from `number` on.
  struct part {
    std::size_t number = 0, count = 1;
  };

  /// Where they come from: texts of the caller's, which may be empty. None is interpreted.
  struct record {
    std::string maps;       ///< of which maps, and how these were made
    std::string version;    ///< of the library that matched them
    std::string processor;  ///< instruction set for which that library was compiled

    friend bool operator==(const record&, const record&) = default;
  };

  std::uint64_t fingerprint = 0;    ///< of the positions of all maps of the survey, and of what was asked
  std::vector<std::uint32_t> maps;  ///< that asked, ascending
  std::vector<std::string> links;   ///< of each of them, as bytes
  survey_matches::record provenance;
  bool cancelled = false;  ///< the progress callback said so; nothing else is filled
};

namespace detail {
inline constexpr std::array<std::string_view, 2> survey_matches_sections = {"prov", "link"};
inline constexpr sections_format survey_matches_format = {"\x89GMSL\r\n\n", "survey matches", 1, 1,
                                                          survey_matches_sections};

template <class Archive, either_const<survey_matches::record> V>
void serialize(Archive& archive, V& value) {
  auto& [maps, version, processor] = value;
  archive(maps, version, processor);
}
}  // namespace detail

/// Writes matches, exactly, in a form that does not depend on the platform. The stream must be binary. Throws
/// `std::runtime_error` when it fails.
inline void write_survey_matches(std::ostream& out, const survey_matches& matches) {
  std::array<detail::output_archive, 2> archives;
  archives[0](matches.provenance);
  archives[1](matches.fingerprint, matches.maps, matches.links);
  const std::array<std::string, 2> contents = {std::move(archives[0]).bytes(),
                                               std::move(archives[1]).bytes()};
  detail::write_sections(out, detail::survey_matches_format, contents);
}

/// Reads what `write_survey_matches` wrote, from where the binary stream is, and nothing behind it. Throws
/// `std::runtime_error` for a file of another kind or a newer version, cut off, or damaged.
inline survey_matches read_survey_matches(std::istream& in) {
  survey_matches matches;
  detail::section_reader sections(in, detail::survey_matches_format);
  const std::string provenance = sections.read(), links = sections.read();
  const std::string damaged = "the survey matches file is damaged: it";
  detail::input_archive first(provenance, damaged), second(links, damaged);
  first(matches.provenance);
  first.finish();
  second(matches.fingerprint, matches.maps, matches.links);
  second.finish();
  if (matches.maps.size() != matches.links.size()) second.fail("does not hold the links of each map");
  return matches;
}

}  // namespace globalmatch

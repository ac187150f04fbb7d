// Stem maps in files (.gmap), so that a scan is mapped once and registered as often as needed. The format is
// described in docs/stem_map_file.md.
#pragma once

#include <array>
#include <istream>
#include <ostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "globalmatch/detail/core/byte_archives.hpp"
#include "globalmatch/detail/core/checked_sections.hpp"
#include "globalmatch/detail/stem_map_io/check_stem_map.hpp"
#include "globalmatch/detail/stem_map_io/sample_fields.hpp"
#include "globalmatch/detail/stem_map_io/stem_map_fields.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch {

/// What a file holds.
struct stem_map_file {
  /// Where a map comes from: texts of the caller's, by which it knows whether the map is still that of its
  /// scan and options. They may be empty; none is interpreted.
  struct scan_record {
    std::string input;         ///< name of the scan
    std::string content_hash;  ///< of the scan
    std::string options;       ///< with which it was mapped
    std::string version;       ///< of the library that mapped it
    std::string processor;     ///< instruction set for which that library was compiled

    friend bool operator==(const scan_record&, const scan_record&) = default;
  };

  /// What is read of a file: each choice includes the ones before it.
  enum class parts {
    provenance,  ///< the map stays empty
    stems,  ///< without samples and the ground points of the terrain: enough to match stems, not to refine
    all,
  };

  stem_map map;
  scan_record provenance;
};

namespace detail {

inline constexpr std::array<std::string_view, 7> stem_map_sections = {"prov", "summ", "stem", "terr",
                                                                      "grnd", "smpl", "view"};
/// Like that of PNG: a byte that is no ASCII, and line ends that a transfer as text would change.
inline constexpr sections_format stem_map_format = {"\x89GMAP\r\n\n", "stem map", 1, 2, stem_map_sections, 6};

template <class Archive, either_const<stem_map_file::scan_record> V>
void serialize(Archive& archive, V& value) {
  auto& [input, content_hash, options, version, processor] = value;
  archive(input, content_hash, options, version, processor);
}

/// Reads the next section with `read_values(archive)`, which returns what is wrong with the values, or an
/// empty text.
template <class ReadValues>
void read_section(section_reader& sections, const ReadValues& read_values) {
  const std::string name = "the stem map file is damaged: its section '" + sections.name() + "'";
  const std::string bytes = sections.read();
  input_archive archive(bytes, name);
  const std::string problem = read_values(archive);
  archive.finish();
  if (!problem.empty()) archive.fail("does not hold a map: " + problem);
}

}  // namespace detail

/// Writes a map in a form that does not depend on the platform. Everything is written bit for bit but for
/// `stem::support`, which names points of a scan that need not be there any more.
///
/// The stream must be binary; a file is written whole or not at all by writing a sibling first, and renaming
/// it. Throws `std::invalid_argument` for a map whose terrain contradicts itself or whose samples are not
/// finite, before it writes anything, and `std::runtime_error` when the stream fails.
inline void write_stem_map(std::ostream& out, const stem_map& map,
                           const stem_map_file::scan_record& provenance = {}) {
  using namespace detail;
  for (const std::string& problem : {describe_raster_error(map.terrain), describe_ground_error(map.terrain),
                                     describe_sample_error(map), describe_view_error(map)})
    if (!problem.empty()) throw std::invalid_argument("stem map: " + problem);
  std::array<output_archive, stem_map_sections.size()> archives;
  archives[0](provenance);
  serialize_summary(archives[1], map);
  archives[2](map.stems);
  serialize_raster(archives[3], map.terrain);
  serialize_ground(archives[4], map.terrain);
  write_samples(archives[5], map);
  serialize_view(archives[6], map.visible);
  std::array<std::string, archives.size()> contents;
  for (std::size_t i = 0; i < contents.size(); ++i) contents[i] = std::move(archives[i]).bytes();
  write_sections(out, stem_map_format, contents);
}

/// Reads what `write_stem_map` wrote, from where the stream is, and nothing behind it. The map has the bits
/// of the one that was written, on every processor: what is registered by it is what the other would give.
///
/// The stream must be binary. Of parts that are not asked for only the length is checked; a stream that can
/// be positioned passes over them. Memory follows what the stream holds, not what it says that it holds.
/// Throws `std::runtime_error` for a file of another kind, of a newer version, cut off, or damaged.
inline stem_map_file read_stem_map(std::istream& in, stem_map_file::parts parts = stem_map_file::parts::all) {
  using namespace detail;
  stem_map_file file;
  stem_map& map = file.map;
  section_reader sections(in, stem_map_format);
  const auto read = [&](stem_map_file::parts of, const auto& read_values) {
    if (parts < of) return sections.skip();
    read_section(sections, read_values);
  };
  read(stem_map_file::parts::provenance, [&](input_archive& a) { return a(file.provenance), std::string(); });
  read(stem_map_file::parts::stems,
       [&](input_archive& a) { return serialize_summary(a, map), std::string(); });
  read(stem_map_file::parts::stems, [&](input_archive& a) { return a(map.stems), std::string(); });
  read(stem_map_file::parts::stems, [&](input_archive& a) {
    serialize_raster(a, map.terrain);
    return describe_raster_error(map.terrain);
  });
  read(stem_map_file::parts::all, [&](input_archive& a) {
    serialize_ground(a, map.terrain);
    return describe_ground_error(map.terrain);
  });
  read(stem_map_file::parts::all, [&](input_archive& a) {
    read_samples(a, map);
    return describe_sample_error(map);
  });
  if (!sections.has_next()) return file;  // of version 1
  read(stem_map_file::parts::all, [&](input_archive& a) {
    serialize_view(a, map.visible);
    return describe_view_error(map);
  });
  return file;
}

}  // namespace globalmatch

// Against the packages laz-perf and copc for Node.js, point by point.
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "catch.hpp"
#include "las_checks.hpp"
#include "support/scalars.hpp"

namespace globalmatch::support::test_laz_oracle_files {

namespace {

namespace fs = std::filesystem;

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

bool is_compressed(const fs::path& path) {
  return path.extension() == ".laz" || path.extension() == ".LAZ";
}

std::vector<fs::path> compressed_files() {
  std::vector<fs::path> files;
  const auto add = [&](const fs::path& folder) {
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (entry.is_regular_file() && is_compressed(entry.path())) files.push_back(entry.path());
  };
  add(GLOBALMATCH_TEST_DATA);
  if (const std::string folder = environment("GLOBALMATCH_LAS_FIXTURES"); !folder.empty()) add(folder);
  return files;
}

Eigen::Vector3d position_in(const char* record, const las_header& header) {
  const auto raw = [&](std::size_t axis) {
    return static_cast<double>(load<std::int32_t>(record + 4 * axis, std::endian::little));
  };
  return Eigen::Vector3d(raw(0), raw(1), raw(2)).cwiseProduct(header.scale) + header.offset;
}

// Records or points that differ from those of the oracle.
std::size_t count_different(const fs::path& path, const std::string& expected) {
  const file_bytes file(path);
  const las_header header = read_las_header(file);
  const std::string records = decoded_records(path);
  const points read = all_points(*open_las_file(path, {.keep_marked = true}).points);
  REQUIRE(records.size() == expected.size());
  REQUIRE(read.size() * header.record_size == expected.size());
  std::size_t different = 0;
  for (std::size_t i = 0; i < read.size(); ++i) {
    const std::string_view record =
        std::string_view(expected).substr(i * header.record_size, header.record_size);
    different += record != std::string_view(records).substr(i * header.record_size, header.record_size) ||
                 read[i] != position_in(record.data(), header);
  }
  return different;
}

}  // namespace

TEST_CASE("compressed points are those of laz-perf and copc") {
  const std::string modules = environment("GLOBALMATCH_NODE_MODULES");
  if (modules.empty()) {
    WARN("skipped: there is no GLOBALMATCH_NODE_MODULES, a folder with laz-perf and copc for Node.js");
    return;
  }
  const temporary_directory directory;
  const std::string script = (fs::path(GLOBALMATCH_TEST_DATA).parent_path() / "laz_records.cjs").string();
  const fs::path out = directory / "records";
  std::size_t compared = 0;
  for (const fs::path& path : compressed_files()) {
    INFO(path);
    if (const std::string refusal = error_of([&] { open_las_file(path); }); !refusal.empty()) {
      WARN(refusal);
      continue;
    }
    if (path.stem() == "format_8_version_4" || path.stem() == "format_3_streamed")
      continue;  // which it cannot
    const std::string command = "NODE_PATH=\"" + modules + "\" node \"" + script + "\" \"" + path.string() +
                                "\" \"" + out.string() + '"';
    REQUIRE(std::system(command.c_str()) == 0);
    CHECK(count_different(path, bytes_of(out)) == 0);
    ++compared;
  }
  CHECK(compared >= 7);
}

}  // namespace globalmatch::support::test_laz_oracle_files

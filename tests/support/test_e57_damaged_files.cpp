// Damaged E57 files are refused or read, and never crash the reader or make it loop. And what another reader
// makes of the same files.
#include <cstdlib>
#include <fstream>
#include <random>
#include <sstream>

#include "catch.hpp"
#include "e57_checks.hpp"
#include "e57_writer.hpp"
#include "file_checks.hpp"
#include "support/e57.hpp"
#include "support/posed_copies.hpp"

namespace globalmatch::support::test_e57_damaged_files {

namespace {

/// Reads all scans; true if there were any, or a `file_error`.
bool is_answered(const std::filesystem::path& path) {
  std::size_t scans = 0, points_read = 0;
  const std::string error = error_of([&] {
    scans = count_scans_of(path);
    for (std::size_t number = 1; number <= scans; ++number) {
      const opened_scan scan = open_e57_file(path, number);
      points all(scan.points->size());
      scan.points->read(0, all);
      points_read += all.size();
    }
  });
  return !error.empty() || points_read <= std::filesystem::file_size(path) * std::max<std::size_t>(scans, 1);
}

/// Two small scans of all types of fields.
std::string small_file() {
  const std::vector<std::int64_t> values = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  const written_scan scaled{
      {integer_field("cartesianX", -3, 9, values, "type=\"ScaledInteger\" scale=\"0.5\""),
       integer_field("cartesianY", 0, 1000, values), double_field("cartesianZ", std::vector<double>(9, 0.5)),
       integer_field("cartesianInvalidState", 0, 2, std::vector<std::int64_t>(9, 0))},
      e57_pose(Eigen::Quaterniond::Identity(), {1, 2, 3}),
      3};
  const written_scan spherical{{float_field("sphericalRange", {1, 2}),
                                float_field("sphericalAzimuth", {1, 2}),
                                float_field("sphericalElevation", {1, 2})}};
  return e57_file({scaled, spherical});
}

}  // namespace

TEST_CASE("an E57 file with any byte flipped is refused or read, also where checksums fit it") {
  const temporary_directory directory;
  const std::string whole = small_file();
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string bytes = whole;
    bytes[i] = static_cast<char>(bytes[i] ^ 1 << i % 8);
    CHECK(is_answered(directory.file("damaged.e57", bytes)));
    for (const int flipped : {1 << i % 8, 255}) {
      bytes[i] = static_cast<char>(whole[i] ^ flipped);
      seal_pages(bytes);
      CHECK(is_answered(directory.file("sealed.e57", bytes)));
      bytes = whole;
    }
  }
}

TEST_CASE("an E57 file of any shorter length is refused") {
  const temporary_directory directory;
  const std::string whole = small_file();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto path = directory.file("a.e57", whole.substr(0, size));
    CHECK_FALSE(error_of([&] { count_scans_of(path); }).empty());
  }
}

TEST_CASE("an E57 file with random bytes in its packets is refused or read") {
  const temporary_directory directory;
  std::mt19937 random(11);
  const std::string whole = small_file();
  const std::size_t xml = whole.find("<?xml");
  for (int trial = 0; trial < 2000; ++trial) {
    std::string bytes = whole;
    for (std::size_t changes = 1 + random() % 8; changes > 0; --changes)
      bytes[48 + random() % (xml - 48)] =
          static_cast<char>(random() % 4 == 0 ? random() % 256 : random() % 3);
    seal_pages(bytes);
    CHECK(is_answered(directory.file("a.e57", bytes)));
  }
}

TEST_CASE("deeply nested elements of an E57 description do not exhaust the stack") {
  const temporary_directory directory;
  std::string nested;
  for (int i = 0; i < 100'000; ++i) nested += "<a type=\"Structure\">";
  for (int i = 0; i < 100'000; ++i) nested += "</a>";
  written_scan scan{
      {float_field("cartesianX", {1}), float_field("cartesianY", {2}), float_field("cartesianZ", {3})}};
  scan.fields[2].declaration += "/>" + nested + "<b type=\"Integer\"";  // within the prototype
  scan.pose = nested;
  const auto path = directory.file("a.e57", e57_file({scan}));
  CHECK(error_of([&] { open_e57_file(path, 1); }).find("other fields") != std::string::npos);
}

// The npm package web-e57, whose XYZ has all digits. It applies poses, which `open_e57` does not; also those
// of copies.
TEST_CASE("web-e57 reads the same points as open_e57") {
  const char* folder = std::getenv("GLOBALMATCH_WEB_E57");
  if (folder == nullptr) {
    WARN("skipped: GLOBALMATCH_WEB_E57 names no folder where `npm install web-e57` was run");
    return;
  }
  const temporary_directory directory;
  const auto script = directory.file("convert.mjs", R"(
import { readFileSync } from "node:fs";
const [folder, file] = process.argv.slice(2).map((path) => new URL("file://" + path));
const glue = await import(folder.href + "/node_modules/web-e57/e57_bg.js");
const code = readFileSync(new URL(folder.href + "/node_modules/web-e57/e57_bg.wasm"));
const { instance } = await WebAssembly.instantiate(code, { "./e57_bg.js": glue });
glue.__wbg_set_wasm(instance.exports);
process.stdout.write(glue.convertE57(new Uint8Array(readFileSync(file)), "XYZ"));
)");
  std::mt19937 random(17);
  std::uniform_real_distribution<float> coordinate(-50, 50);
  for (int trial = 0; trial < 20; ++trial) {
    const std::size_t count = random() % 3000 + 1;
    const auto field = [&](const char* name) {
      if (random() % 2 == 0) {
        std::vector<float> values(count);
        for (float& value : values) value = coordinate(random);
        return float_field(name, values);
      }
      const std::int64_t maximum = std::int64_t(1) << random() % 40;
      std::vector<std::int64_t> values(count);
      for (auto& value : values) value = std::uniform_int_distribution<std::int64_t>(-9, maximum)(random);
      return integer_field(name, -9, maximum, values, "type=\"ScaledInteger\" scale=\"0.001\" offset=\"3\"");
    };
    written_scan scan{
        {field("cartesianX"), field("cartesianY"), field("cartesianZ")}, {}, random() % 500 + 9};
    scan.has_other_packets = false;  // which web-e57 1.2 does not know
    const bool has_pose = trial % 2 == 1;
    if (has_pose) scan.pose = e57_pose(Eigen::Quaterniond(0.8, 0, 0, 0.6), {10, 20, 30});
    auto path = directory.file("a.e57", e57_file({scan}));
    if (trial % 4 == 3) {  // of the same pose, which the file did not have
      scan.pose.clear();
      write_posed_copy(directory / "copy.e57", directory.file("b.e57", e57_file({scan})),
                       Eigen::Translation3d(10, 20, 30) * Eigen::Quaterniond(0.8, 0, 0, 0.6));
      path = directory / "copy.e57";
    }
    const opened_scan opened = open_e57_file(path, 1);
    points read(opened.points->size());
    opened.points->read(0, read);

    const std::string output = (directory / "a.xyz").string();
    const std::string command =
        "node \"" + script.string() + "\" \"" + folder + "\" \"" + path.string() + "\" > \"" + output + "\"";
    REQUIRE(std::system(command.c_str()) == 0);
    std::istringstream lines(bytes_of(output));
    std::size_t differing = 0, lines_read = 0;
    for (Eigen::Vector3d p; lines >> p[0] >> p[1] >> p[2]; ++lines_read) {
      const Eigen::Vector3d& q = read[std::min(lines_read, read.size() - 1)];
      differing += has_pose ? (*opened.header.pose * q - p).norm() > 1e-12 * (1 + p.norm()) : p != q;
    }
    CHECK(lines_read == read.size());
    CHECK(differing == 0);
  }
}

}  // namespace globalmatch::support::test_e57_damaged_files

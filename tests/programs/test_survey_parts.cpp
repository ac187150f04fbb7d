// register_survey in parts, of several processes that share a folder: the bits of one process, whatever was
// damaged, is of others, or was killed.
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "catch.hpp"
#include "globalmatch/stem_map_io.hpp"
#include "globalmatch/survey_matches.hpp"
#include "programs/program_run.hpp"
#include "programs/written_surveys.hpp"

#if !defined(_WIN32)
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <thread>
#endif

namespace globalmatch::support::test_survey_parts {

using Catch::Matchers::Contains;

namespace {

const std::string seven_maps = "--stem-maps s1.csv s2.csv s3.csv s4.csv s5.csv s6.csv s7.csv ";
const std::string seven_reversed = "--stem-maps s7.csv s6.csv s5.csv s4.csv s3.csv s2.csv s1.csv ";

int survey_status(const temporary_directory& directory, const std::string& arguments) {
  const run result = call(directory, "register_survey", arguments);
  INFO(result.complaint);
  CHECK(result.status == 0);
  return result.status;
}

survey_matches read_matches(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return read_survey_matches(in);
}

void write_matches(const std::filesystem::path& file, const survey_matches& matches) {
  std::ofstream out(file, std::ios::binary);
  write_survey_matches(out, matches);
}

}  // namespace

TEST_CASE("register_survey in 1, 2 and 7 parts and other orders of inputs has the bytes of one process") {
  const temporary_directory directory;
  write_stand(directory, 7);
  REQUIRE(survey_status(directory, seven_maps + "--out-dir one") == 0);
  const auto expected = results_in(directory / "one");
  CHECK(expected.size() == 11);
  for (const int parts : {1, 2, 7}) {
    const std::string out = "--out-dir in_" + std::to_string(parts);
    for (int i = parts; i > 0; --i)
      REQUIRE(survey_status(directory, (i % 2 == 0 ? seven_maps : seven_reversed) + out +
                                           " --only match --part " + std::to_string(i) + "/" +
                                           std::to_string(parts)) == 0);
    const std::filesystem::path folder = directory / ("in_" + std::to_string(parts));
    CHECK(results_in(folder).empty());
    REQUIRE(survey_status(directory, seven_reversed + out + " --only solve") == 0);
    CHECK(results_in(folder) == expected);
    REQUIRE(survey_status(directory, seven_maps + out + " --threads 1") == 0);
    CHECK(results_in(folder) == expected);
  }
  REQUIRE(survey_status(directory, seven_maps + "--out-dir in_2 --only match --part 2/2") == 0);
  CHECK_THAT(bytes_of(directory / "stdout.log"), Contains("part_2_of_2: matched before"));
}

TEST_CASE("matches that register_survey finds are used, damaged or foreign ones done again") {
  const temporary_directory directory;
  write_stand(directory, 7);
  REQUIRE(survey_status(directory, seven_maps + "--out-dir one") == 0);
  const auto expected = results_in(directory / "one");
  const std::string match = "--out-dir out --only match --part ";
  for (const char* part : {"1/3", "2/3", "3/3"})
    REQUIRE(survey_status(directory, seven_maps + match + part) == 0);
  const auto file_of = [&](int part) {
    return directory / ("out/matches/part_" + std::to_string(part) + "_of_3.gmatch");
  };
  const survey_matches found = read_matches(file_of(1));
  survey_matches emptied = found;
  for (std::string& links : emptied.links) links.assign(16, '\0');
  write_matches(file_of(1), emptied);
  REQUIRE(call(directory, "register_survey", seven_maps + "--out-dir out --only solve").status <= 1);
  CHECK(results_in(directory / "out") != expected);

  write_matches(file_of(1), found);
  std::filesystem::resize_file(file_of(2), std::filesystem::file_size(file_of(2)) - 1);
  REQUIRE(survey_status(directory,
                        "--stem-maps s1.csv s2.csv s3.csv --out-dir other --only match --part 3/3") == 0);
  std::filesystem::copy_file(directory / "other/matches/part_3_of_3.gmatch", file_of(3),
                             std::filesystem::copy_options::overwrite_existing);
  directory.file("out/matches/notes.gmatch", "no matches at all");
  std::filesystem::remove(directory / "out/survey.json");
  REQUIRE(survey_status(directory, seven_maps + "--out-dir out --only solve") == 0);
  CHECK(results_in(directory / "out") == expected);
}

TEST_CASE("matches of another build or instruction set are refused by name in a stage, and else done again") {
  const temporary_directory directory;
  write_stand(directory, 7);
  REQUIRE(survey_status(directory, seven_maps + "--out-dir out --only match") == 0);
  const auto file = directory / "out/matches/part_1_of_1.gmatch";
  const survey_matches found = read_matches(file);
  for (const bool other_version : {true, false}) {
    survey_matches other = found;
    (other_version ? other.provenance.version : other.provenance.processor) = "quite another";
    write_matches(file, other);
    for (const char* stage : {"solve", "match"}) {
      const run refused =
          call(directory, "register_survey", seven_maps + "--out-dir out --only " + std::string(stage));
      CHECK(refused.status == 2);
      CHECK_THAT(refused.complaint, Contains("part_1_of_1.gmatch") && Contains("quite another") &&
                                        Contains(found.provenance.version));
      CHECK(results_in(directory / "out").empty());
    }
  }
  REQUIRE(survey_status(directory, seven_maps + "--out-dir out") == 0);
}

#if !defined(_WIN32)
TEST_CASE("register_survey that runs twice at once in one folder has the bytes of one process") {
  const temporary_directory directory;
  write_stand(directory, 7);
  REQUIRE(survey_status(directory, seven_maps + "--out-dir one") == 0);
  const std::string program = "\"" GLOBALMATCH_PROGRAMS "/register_survey\" ";
  const std::string both = "cd \"" + directory.path().string() + "\" && { " + program + seven_maps +
                           "--out-dir out > a.log 2>&1 & " + program + seven_reversed +
                           "--out-dir out > b.log 2>&1 && wait $!; }";
  for (int i = 0; i < 5; ++i) {
    REQUIRE(std::system(both.c_str()) == 0);
    CHECK(results_in(directory / "out") == results_in(directory / "one"));
    std::filesystem::remove_all(directory / "out");
  }
}
#endif

TEST_CASE("parts that are none, or of a stage that has none, are wrong usage") {
  const temporary_directory directory;
  write_stand(directory, 3);
  const std::string maps = "--stem-maps s1.csv s2.csv s3.csv --out-dir out ";
  for (const char* wrong : {"--only match --part 3/2", "--only match --part 0/2", "--only match --part x",
                            "--only solve --part 1/2", "--part 1/2", "--only everything"})
    CHECK(call(directory, "register_survey", maps + wrong).status == 2);
}

#if !defined(_WIN32) && defined(GLOBALMATCH_HAS_SIMULATOR)
namespace {

/// Runs register_survey in a directory, and kills it after a while, if it is not done by then; whether it
/// was.
bool runs_to_end(const temporary_directory& directory, std::vector<std::string> arguments,
                 std::chrono::microseconds kill_after) {
  arguments.insert(arguments.begin(), GLOBALMATCH_PROGRAMS "/register_survey");
  std::vector<char*> raw;
  for (std::string& a : arguments) raw.push_back(a.data());
  raw.push_back(nullptr);
  const std::string folder = directory.path().string();
  const pid_t child = fork();
  if (child == 0) {
    const int nowhere = open("/dev/null", O_WRONLY);
    if (chdir(folder.c_str()) == 0 && dup2(nowhere, 1) >= 0 && dup2(nowhere, 2) >= 0)
      execv(raw[0], raw.data());
    _exit(127);
  }
  REQUIRE(child > 0);
  std::this_thread::sleep_for(kill_after);
  kill(child, SIGKILL);
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  REQUIRE((WIFSIGNALED(status) || WIFEXITED(status)));
  if (WIFEXITED(status)) REQUIRE(WEXITSTATUS(status) == 0);
  return WIFEXITED(status);
}

}  // namespace

TEST_CASE("register_survey that is killed at 20 moments and resumed loses nothing and has the same bytes") {
  const temporary_directory directory;
  REQUIRE(call(directory, "simulate_plot", "scans --stations 4 --angular-step 0.25 --seed 7").status == 0);
  const auto start = std::chrono::steady_clock::now();
  REQUIRE(survey_status(directory, "scans --out-dir one") == 0);
  const auto whole =
      std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - start);
  constexpr int moments = 20;
  std::size_t killed = 0, mapped = 0;
  for (int k = 0; k < moments; ++k) {
    // Fresh at each fifth moment, so that later ones strike runs that were stopped several times.
    if (k % 5 == 0) std::filesystem::remove_all(directory / "out"), mapped = 0;
    killed += !runs_to_end(directory, {"scans", "--out-dir", "out"}, whole * (k + 1) / (moments + 1));
    std::size_t maps = 0;
    if (std::filesystem::exists(directory / "out/maps"))
      for (const auto& [name, bytes] : results_in(directory / "out/maps")) {
        if (!name.ends_with(".gmap")) continue;
        ++maps;
        CHECK(bytes == bytes_of(directory / "one/maps" / name));
      }
    CHECK(maps >= mapped);
    mapped = maps;
  }
  CHECK(killed > 0);
  REQUIRE(survey_status(directory, "scans --out-dir out") == 0);
  CHECK(results_in(directory / "out") == results_in(directory / "one"));
  CHECK(results_in(directory / "out/maps") == results_in(directory / "one/maps"));
}

TEST_CASE("maps of another build are refused by name where others work with them, and else made again") {
  const temporary_directory directory;
  REQUIRE(call(directory, "simulate_plot", "scans --stations 2 --angular-step 0.3 --seed 8").status == 0);
  REQUIRE(survey_status(directory, "scans --out-dir out --only map") == 0);
  const auto file = directory / "out/maps/scan_1.gmap";
  const std::string known = bytes_of(file);
  std::ifstream in(file, std::ios::binary);
  stem_map_file map = read_stem_map(in);
  in.close();
  map.provenance.processor = "quite another";
  std::ofstream out(file, std::ios::binary);
  write_stem_map(out, map.map, map.provenance);
  out.close();
  for (const char* stage : {"match", "solve"}) {
    const run refused =
        call(directory, "register_survey", "scans --out-dir out --only " + std::string(stage));
    CHECK(refused.status == 2);
    CHECK_THAT(refused.complaint, Contains("scan_1.gmap") && Contains("quite another"));
  }
  REQUIRE(survey_status(directory, "scans --out-dir out --only map") == 0);
  CHECK(bytes_of(file) == known);
}
#endif

}  // namespace globalmatch::support::test_survey_parts

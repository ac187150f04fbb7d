#include "support/atomic_file.hpp"

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

#include "catch.hpp"
#include "file_checks.hpp"
#include "support/process_identity.hpp"

namespace globalmatch::support::test_atomic_file {

namespace {

void write(const std::filesystem::path& path, const std::string& text) {
  atomic_file file(path);
  file.stream() << text;
  file.commit();
}

}  // namespace

TEST_CASE("a committed file holds what was written and leaves nothing beside it") {
  const temporary_directory directory;
  write(directory / "a.txt", "new");
  CHECK(bytes_of(directory / "a.txt") == "new");
  CHECK(directory.count_files() == 1);
}

TEST_CASE("a file that is not committed leaves the old one untouched and nothing beside it") {
  const temporary_directory directory;
  const auto path = directory.file("a.txt", "old");
  {
    atomic_file file(path);
    file.stream() << "new" << std::flush;
    CHECK(bytes_of(path) == "old");
  }
  CHECK(bytes_of(path) == "old");
  CHECK(directory.count_files() == 1);
}

TEST_CASE("committing replaces an old file") {
  const temporary_directory directory;
  const auto path = directory.file("a.txt", "a longer old text");
  write(path, "new");
  CHECK(bytes_of(path) == "new");
}

TEST_CASE("writing through a symbolic link replaces the file, not the link") {
  const temporary_directory directory;
  const auto path = directory.file("a.txt", "old");
  std::error_code impossible;
  std::filesystem::create_symlink(path, directory / "link.txt", impossible);
  if (impossible) {
    WARN("skipped: there are no symbolic links");
    return;
  }
  write(directory / "link.txt", "new");
  CHECK(std::filesystem::is_symlink(directory / "link.txt"));
  CHECK(bytes_of(path) == "new");
}

TEST_CASE("devices are written, not replaced") {
  const std::filesystem::path null = "/dev/null";
  if (!std::filesystem::is_character_file(null)) {
    WARN("skipped: there is no /dev/null");
    return;
  }
  write(null, "text");
  CHECK(std::filesystem::is_character_file(null));
}

TEST_CASE("a missing directory is named, with the command that makes it") {
  const temporary_directory directory;
  const auto open = [](const std::filesystem::path& path) { atomic_file file(path); };
  require_error(directory / "none" / "a.txt", open, "does not exist", "mkdir -p");
}

TEST_CASE("a directory is no file to write") {
  const temporary_directory directory;
  const auto open = [](const std::filesystem::path& path) { atomic_file file(path); };
  require_error(directory.path(), open, "is a directory", "Name a file");
}

TEST_CASE("a directory that may not be written is named") {
  const temporary_directory directory;
  std::filesystem::permissions(directory.path(), std::filesystem::perms::owner_write,
                               std::filesystem::perm_options::remove);
  const bool may_write_all_the_same = std::ofstream(directory / "probe").is_open();
  if (may_write_all_the_same) {
    WARN("skipped: this user may write anywhere");
  } else {
    const auto open = [](const std::filesystem::path& path) { atomic_file file(path); };
    require_error(directory / "a.txt", open, "cannot be written", "permissions");
  }
  std::filesystem::permissions(directory.path(), std::filesystem::perms::owner_all);
}

TEST_CASE("numbers are written so that reading yields the same bits") {
  const temporary_directory directory;
  atomic_file file(directory / "a.txt");
  file.stream() << 0.1 + 0.2;
  file.commit();
  CHECK(std::stod(bytes_of(directory / "a.txt")) == 0.1 + 0.2);
}

#if !defined(_WIN32)
TEST_CASE("temporary files of a process that has ended are removed, those of others are left") {
  const temporary_directory directory;
  const auto ended = directory / "ended.txt";
  REQUIRE(std::system(("echo $$ > \"" + ended.string() + "\"").c_str()) == 0);
  const std::string number = std::to_string(std::stol(bytes_of(ended)));
  const process_identity own = process_identity::own();
  const std::string mark = "a.csv." + own.host + "-";
  directory.file(mark + number + "-7.part", "half");
  directory.file(mark + std::to_string(own.process) + "-7.part", "half");
  directory.file("a.csv.elsewhere_" + own.host + "-" + number + "-7.part", "half");
  directory.file("a.csv", "whole");
  remove_abandoned(directory.path());
  CHECK_FALSE(std::filesystem::exists(directory / (mark + number + "-7.part")));
  CHECK(directory.count_files() == 4);
  std::filesystem::last_write_time(directory / ("a.csv.elsewhere_" + own.host + "-" + number + "-7.part"),
                                   std::filesystem::file_time_type::clock::now() - std::chrono::hours(25));
  remove_abandoned(directory.path());
  CHECK(directory.count_files() == 3);
  CHECK(bytes_of(directory / "a.csv") == "whole");
  remove_abandoned(directory / "absent");
}
#endif

}  // namespace globalmatch::support::test_atomic_file

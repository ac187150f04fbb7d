#include "support/content_hash.hpp"

#include <chrono>
#include <filesystem>
#include <string>

#include "catch.hpp"
#include "support/file_error.hpp"
#include "temporary_directory.hpp"

namespace globalmatch::support::test_content_hash {

namespace {

void set_age(const std::filesystem::path& file, std::chrono::seconds age) {
  std::filesystem::last_write_time(file, std::filesystem::file_time_type::clock::now() - age);
}

}  // namespace

TEST_CASE("hashes differ where contents do, and that of a text is that of a file that holds it") {
  const temporary_directory directory;
  std::string previous;
  for (const std::string text :
       {"", "a", "b", "ab", "some more than eight bytes", "some more than eight byteS"}) {
    const std::string hash = content_hash(directory.file("a.txt", text));
    CHECK(hash.size() == 16);
    CHECK(hash == text_hash(text));
    CHECK(hash != previous);
    previous = hash;
  }
  CHECK(text_hash(std::string(8, '\0')) != text_hash(std::string(16, '\0')));
  CHECK_THROWS_AS(content_hash(directory / "absent"), file_error);
}

TEST_CASE("the hash of a folder is that of the names and contents of its files") {
  const temporary_directory directory;
  std::filesystem::create_directory(directory / "a");
  directory.file("a/1.las", "one");
  const std::string one = content_hash(directory / "a");
  directory.file("a/2.las", "two");
  const std::string both = content_hash(directory / "a");
  CHECK(both != one);
  std::filesystem::rename(directory / "a", directory / "b");
  CHECK(content_hash(directory / "b") == both);
  std::filesystem::rename(directory / "b/2.las", directory / "b/3.las");
  CHECK(content_hash(directory / "b") != both);
}

TEST_CASE("a file whose hash is noted is not read again until its size or time is another") {
  const temporary_directory directory;
  const hash_notes notes(directory / "notes");
  const auto file = directory.file("a.las", "one");
  CHECK(notes.hash_of(file) == text_hash("one"));
  CHECK(std::filesystem::is_empty(directory / "notes"));  // it was written just now
  set_age(file, std::chrono::hours(1));
  const auto time = std::filesystem::last_write_time(file);
  CHECK(notes.hash_of(file) == text_hash("one"));
  directory.file("a.las", "two");
  std::filesystem::last_write_time(file, time);
  CHECK(notes.hash_of(file) == text_hash("one"));
  CHECK(hash_notes().hash_of(file) == text_hash("two"));
  set_age(file, std::chrono::hours(2));
  CHECK(notes.hash_of(file) == text_hash("two"));
  directory.file("a.las", "three");
  set_age(file, std::chrono::hours(2));
  CHECK(notes.hash_of(file) == text_hash("three"));
}

TEST_CASE("a note that is damaged, and one of another file, are not taken") {
  const temporary_directory directory;
  const hash_notes notes(directory / "notes");
  const auto a = directory.file("a.las", "one"), b = directory.file("b.las", "two");
  for (const auto& file : {a, b}) set_age(file, std::chrono::hours(1));
  CHECK(notes.hash_of(a) == text_hash("one"));
  CHECK(notes.hash_of(b) == text_hash("two"));
  for (const auto& entry : std::filesystem::directory_iterator(directory / "notes"))
    std::filesystem::resize_file(entry.path(), std::filesystem::file_size(entry.path()) - 1);
  CHECK(notes.hash_of(a) == text_hash("one"));
  CHECK(notes.hash_of(b) == text_hash("two"));
  std::filesystem::remove(a);
  CHECK_THROWS_AS(notes.hash_of(a), file_error);
}

}  // namespace globalmatch::support::test_content_hash

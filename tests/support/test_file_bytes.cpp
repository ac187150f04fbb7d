#include "support/file_bytes.hpp"

#include <array>
#include <filesystem>
#include <string>
#include <thread>

#include "catch.hpp"
#include "file_checks.hpp"

namespace globalmatch::support::test_file_bytes {

TEST_CASE("bytes of a file are read at any place, by several threads at once") {
  const temporary_directory directory;
  std::string content;
  for (int i = 0; i < 100'000; ++i) content += static_cast<char>(i * 7 % 251);
  const file_bytes file(directory.file("a", content));
  REQUIRE(file.size() == content.size());

  std::array<std::string, 4> read;
  std::array<std::thread, 4> threads;
  for (std::size_t t = 0; t < threads.size(); ++t)
    threads[t] = std::thread([&, t] {
      for (std::size_t at = t * 25'000; at < (t + 1) * 25'000; at += 500) {
        char part[500];
        file.read(at, part);
        read[t].append(part, sizeof(part));
      }
    });
  for (std::thread& t : threads) t.join();
  CHECK(read[0] + read[1] + read[2] + read[3] == content);
}

TEST_CASE("bytes beyond the end of a file are an error, wherever they begin") {
  const temporary_directory directory;
  const file_bytes file(directory.file("a", "12345"));
  char bytes[3];
  file.read(2, bytes);
  CHECK(std::string(bytes, 3) == "345");
  for (const std::uint64_t offset : {std::uint64_t(3), std::uint64_t(5), std::uint64_t(6), ~std::uint64_t(0)})
    require_error(
        file.path(), [&](const auto&) { file.read(offset, bytes); }, "ends before", "again");
}

TEST_CASE("a file that is cut off while it is open is an error") {
  const temporary_directory directory;
  const auto path = directory.file("a", std::string(100'000, 'x'));
  const file_bytes file(path);
  std::filesystem::resize_file(path, 10);
  char bytes[20];
  require_error(
      path, [&](const auto&) { file.read(0, bytes); }, "ends before", "again");
}

}  // namespace globalmatch::support::test_file_bytes

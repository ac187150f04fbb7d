#include "support/temporary_file.hpp"

#include <cstdio>
#include <memory>
#include <string>

#include "catch.hpp"
#include "file_checks.hpp"

namespace globalmatch::support::test_temporary_file {

namespace {

struct closer {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using open_file = std::unique_ptr<std::FILE, closer>;

open_file open(const std::filesystem::path& path, const char* mode) {
  return open_file(std::fopen(path.string().c_str(), mode));
}

}  // namespace

TEST_CASE("a temporary file takes all bytes of a stream, and is gone when it ends") {
  const temporary_directory directory;
  std::string bytes;
  for (int i = 0; i < 3'000'000; ++i) bytes += static_cast<char>(i * 7 % 251);
  const open_file stream = open(directory.file("a", bytes), "rb");
  std::filesystem::path copied;
  {
    temporary_file copy("a stream");
    copied = copy.path();
    CHECK(copy.copy_from(stream.get()) == bytes.size());
    CHECK(bytes_of(copied) == bytes);
#if !defined(_WIN32)  // which has no such permissions
    CHECK((std::filesystem::status(copied).permissions() & std::filesystem::perms::others_all) ==
          std::filesystem::perms::none);
#endif
    copy.remove();
    copy.remove();
  }
  CHECK_FALSE(std::filesystem::exists(copied));
}

#if !defined(_WIN32)  // where reading what is only written is an end, and no error
TEST_CASE("a stream that cannot be read is an error that names it") {
  const temporary_directory directory;
  const open_file stream = open(directory / "a", "wb");
  temporary_file copy("standard input");
  const std::string error = error_of([&] { copy.copy_from(stream.get()); });
  using Catch::Matchers::Contains;
  CHECK_THAT(error, Contains("standard input: cannot be read to its end"));
}
#endif

}  // namespace globalmatch::support::test_temporary_file

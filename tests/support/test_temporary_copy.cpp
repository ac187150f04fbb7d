#include "support/temporary_copy.hpp"

#include <cstdio>
#include <memory>
#include <string>

#include "catch.hpp"
#include "file_checks.hpp"

namespace globalmatch::support {

namespace {

struct closer {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

}  // namespace

TEST_CASE("a copy holds all bytes of a stream, and is gone when it ends") {
  const temporary_directory directory;
  std::string bytes;
  for (int i = 0; i < 3'000'000; ++i) bytes += static_cast<char>(i * 7 % 251);
  const auto path = directory.file("a", bytes);
  std::filesystem::path copied;
  {
    const std::unique_ptr<std::FILE, closer> stream(std::fopen(path.string().c_str(), "rb"));
    const temporary_copy copy(stream.get(), "a stream");
    copied = copy.path();
    CHECK(bytes_of(copied) == bytes);
    CHECK((std::filesystem::status(copied).permissions() & std::filesystem::perms::others_all) ==
          std::filesystem::perms::none);
  }
  CHECK_FALSE(std::filesystem::exists(copied));
}

TEST_CASE("a stream that cannot be read is an error that names it, and leaves no copy") {
  const temporary_directory directory;
  const std::unique_ptr<std::FILE, closer> stream(std::fopen((directory / "a").string().c_str(), "wb"));
  const std::string error = error_of([&] { temporary_copy(stream.get(), "standard input"); });
  using Catch::Matchers::Contains;
  CHECK_THAT(error, Contains("standard input: cannot be read to its end"));
}

}  // namespace globalmatch::support

#include "globalmatch/detail/core/byte_archives.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "catch.hpp"

namespace globalmatch::test_byte_archives {

using namespace detail;

namespace {

enum class fruit { apple, pear };

struct record {
  double number = 0;
  std::string text = {};
  std::vector<std::uint16_t> values = {};
  bool truth = false;

  friend bool operator==(const record&, const record&) = default;
};

template <class Archive, either_const<record> V>
void serialize(Archive& archive, V& r) {
  archive(r.number, r.text, r.values, r.truth);
}

std::string bytes_of(const std::vector<record>& records) {
  output_archive out;
  out(records);
  return out.bytes();
}

}  // namespace

TEST_CASE("values are read back as they were written") {
  const std::vector<record> records = {
      {-0.0, "", {}, true},
      {std::numeric_limits<double>::infinity(), std::string("a\0b", 3), {1, 65535}, false}};
  const std::string bytes = bytes_of(records);
  std::vector<record> back = {{}, {}, {}};  // is overwritten
  input_archive in(bytes, "test");
  in(back);
  in.finish();
  CHECK(back == records);
  CHECK(std::signbit(back[0].number));
  CHECK(bytes_of({}) == std::string(8, '\0'));
}

TEST_CASE("bytes that are cut off, left over, or no value that is written are errors with the name") {
  const std::string bytes = bytes_of({{1, "abc", {1, 2, 3}, true}});
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    std::vector<record> back;
    const std::string cut = bytes.substr(0, size);
    input_archive in(cut, "test");
    CHECK_THROWS_WITH(in(back), Catch::StartsWith("test holds less"));
  }
  const std::string longer = bytes + "x";
  input_archive in(longer, "test");
  std::vector<record> back;
  in(back);
  CHECK_THROWS_WITH(in.finish(), Catch::Contains("more than its values"));
  std::string wrong = bytes;
  wrong.back() = 2;
  input_archive of_wrong(wrong, "test");
  CHECK_THROWS_WITH(of_wrong(back), Catch::Contains("neither 0 nor 1"));
}

TEST_CASE("a count beyond the bytes is an error, and takes no memory") {
  output_archive out;
  out.count(std::size_t(1) << 60);
  std::vector<double> numbers;
  std::string text;
  for (const int kind : {0, 1}) {
    input_archive in(out.bytes(), "test");
    if (kind == 0) CHECK_THROWS_AS(in(numbers), std::runtime_error);
    if (kind == 1) CHECK_THROWS_AS(in(text), std::runtime_error);
  }
  CHECK(numbers.capacity() < 1000);
}

TEST_CASE("a choice is one of those that there are") {
  output_archive out;
  out.choice(fruit::pear, fruit::pear);
  fruit read = fruit::apple;
  input_archive(out.bytes(), "test").choice(read, fruit::pear);
  CHECK(read == fruit::pear);
  input_archive in(out.bytes(), "test");
  CHECK_THROWS_AS(in.choice(read, fruit::apple), std::runtime_error);
}

}  // namespace globalmatch::test_byte_archives

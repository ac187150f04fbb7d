#include "globalmatch/detail/core/checked_sections.hpp"

#include <fstream>
#include <sstream>
#include <streambuf>

#include "catch.hpp"
#include "stem_map_bytes.hpp"

// By the stem map files that consist of such sections.
namespace globalmatch::test_checked_sections {

using namespace detail;

using layout = stem_map_layout;

namespace {

/// Bytes that come one after the other, as from a pipe.
class pipe_buffer : public std::streambuf {
 public:
  explicit pipe_buffer(std::string bytes) : bytes_(std::move(bytes)) {}

 private:
  int_type underflow() override {
    if (next_ == bytes_.size()) return traits_type::eof();
    char* const at = &bytes_[next_++];
    setg(at, at, at + 1);
    return traits_type::to_int_type(*at);
  }
  std::string bytes_;
  std::size_t next_ = 0;
};

}  // namespace

TEST_CASE("a reader stops behind its map, whatever it reads of it") {
  const std::string bytes = bytes_of(map_of_one_stem(), some_provenance);
  for (const stem_map_file::parts parts :
       {stem_map_file::parts::provenance, stem_map_file::parts::stems, stem_map_file::parts::all}) {
    std::istringstream file(bytes + bytes + "more");
    pipe_buffer buffer(file.str());
    std::istream pipe(&buffer);
    for (std::istream* in : {static_cast<std::istream*>(&file), &pipe}) {
      for (int i = 0; i < 2; ++i) CHECK(read_stem_map(*in, parts).provenance == some_provenance);
      std::string word;
      CHECK((*in >> word && word == "more"));
    }
  }
}

TEST_CASE("a file that is cut off anywhere is an error, in a file and in a pipe") {
  const std::string bytes = bytes_of(map_of_one_stem(), some_provenance);
  for (std::size_t size = 0; size < bytes.size(); ++size)
    for (const stem_map_file::parts parts :
         {stem_map_file::parts::provenance, stem_map_file::parts::stems, stem_map_file::parts::all}) {
      CAPTURE(size, int(parts));
      CHECK(says(error_of(bytes.substr(0, size), parts), "cut off"));
      pipe_buffer buffer(bytes.substr(0, size));
      std::istream pipe(&buffer);
      CHECK_THROWS_AS(read_stem_map(pipe, parts), std::runtime_error);
    }
}

TEST_CASE("a single bit that is wrong is an error") {
  const std::string bytes = bytes_of(map_of_one_stem(), some_provenance);
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    std::string damaged = bytes;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
    CAPTURE(bit / 8, bit % 8);
    CHECK_FALSE(error_of(damaged).empty());
  }
}

TEST_CASE("files of another kind and of a newer version are refused by name") {
  CHECK(says(error_of("ply\nformat ascii 1.0\n"), "stem map file is of another kind"));
  CHECK(says(error_of(""), "cut off"));
  std::string newer = bytes_of({});
  newer[8] = 7;
  CHECK(says(error_of(newer), "version 7"));
  CHECK(says(error_of(newer), "reads up to 2: update"));
  newer.resize(12);  // what follows may be anything
  CHECK(says(error_of(newer), "version 7"));
  newer[8] = 0;
  CHECK(says(error_of(newer), "version 0"));
  std::ifstream missing("there is no such file");
  CHECK_THROWS_WITH(read_stem_map(missing), Catch::Contains("cannot be read"));
}

TEST_CASE("counts and lengths beyond the file are errors, and no memory is taken for them") {
  const std::string bytes = bytes_of(map_of_one_stem());
  const auto with = [&](std::size_t at, std::uint64_t value) {
    std::string changed = bytes;
    store_little_endian(value, &changed[at]);
    seal_stem_map(changed);
    return error_of(changed);
  };
  for (const std::uint64_t huge : {std::uint64_t(1) << 30, std::uint64_t(1) << 50, ~std::uint64_t(0)}) {
    CHECK(says(with(layout::begin(bytes, 0), huge), "section 'prov' holds less"));
    CHECK(says(with(layout::begin(bytes, 2), huge), "section 'stem' holds less"));
    CHECK(says(with(layout::begin(bytes, 4), huge), "section 'grnd' holds less"));
    CHECK(says(with(layout::begin(bytes, 5) + 2, huge), "section 'smpl' holds less"));
    for (std::size_t section = 0; section < layout::sections; ++section)
      CHECK(says(with(layout::length_at(section), huge), "cut off"));
    std::string long_samples = bytes;
    store_little_endian(huge, &long_samples[layout::length_at(5)]);
    seal_stem_map(long_samples);
    CHECK(says(error_of(long_samples, stem_map_file::parts::stems), "cut off"));
  }
  CHECK(says(with(layout::begin(bytes, 2), 0), "section 'stem' holds more"));
}

TEST_CASE("a stream that takes no more is an error") {
  std::ostringstream out;
  out.setstate(std::ios::badbit);
  CHECK_THROWS_WITH(write_stem_map(out, map_of_one_stem()), Catch::Contains("could not be written"));
}

}  // namespace globalmatch::test_checked_sections

#include "support/point_records.hpp"

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "catch.hpp"
#include "file_checks.hpp"

namespace globalmatch::support::test_point_records {

namespace {

// Records of three bytes, z, a byte, x, y.
template <class T>
std::string records(std::size_t count, std::endian order) {
  std::string bytes;
  for (std::size_t i = 0; i < count; ++i) {
    bytes += "abc";
    put(bytes, T(i % 100 + 2), order);
    bytes += '-';
    put(bytes, T(i % 100), order);
    put(bytes, T(i % 100 + 1), order);
  }
  return bytes;
}

template <class T>
void require_read(const std::filesystem::path& path, scalar type, std::endian order) {
  constexpr std::size_t count = 50;
  const record_layout layout{.begin = 5,
                             .count = count,
                             .size = 4 + 3 * sizeof(T),
                             .offsets = {4 + sizeof(T), 4 + 2 * sizeof(T), 3},
                             .types = {type, type, type},
                             .order = order};
  const point_records source(file_bytes(path), layout);
  REQUIRE(source.size() == count);
  points read(20);
  source.read(30, read);
  for (int i = 0; i < 20; ++i) CHECK(read[std::size_t(i)] == Eigen::Vector3d(30 + i, 31 + i, 32 + i));
}

}  // namespace

TEST_CASE("coordinates of records are read in every type and byte order") {
  const temporary_directory directory;
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    const auto file = [&]<class T>(T) { return directory.file("a", "start" + records<T>(50, order)); };
    for (const scalar type :
         {scalar::int8, scalar::uint8, scalar::int16, scalar::uint16, scalar::int32, scalar::uint32,
          scalar::int64, scalar::uint64, scalar::float32, scalar::float64})
      visit_type(type, [&]<class T>(T value) { require_read<T>(file(value), type, order); });
  }
}

TEST_CASE("records that the file has no room for are an error before any is read") {
  const temporary_directory directory;
  const auto path = directory.file("a", records<float>(3, std::endian::little));
  const auto open = [&](std::uint64_t begin, std::size_t count) {
    return [=](const std::filesystem::path& p) {
      point_records(file_bytes(p), {.begin = begin, .count = count, .size = 16});
    };
  };
  open(0, 3)(path);
  open(48, 0)(path);
  require_error(path, open(1, 3), "ends before", "again");
  require_error(path, open(0, 4), "ends before", "again");
  require_error(path, open(49, 0), "ends before", "again");
  require_error(path, open(0, std::numeric_limits<std::size_t>::max()), "ends before", "again");
}

}  // namespace globalmatch::support::test_point_records
